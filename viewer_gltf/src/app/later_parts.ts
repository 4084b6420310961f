/** Parts of the page that nobody needs before the first picture. */
import { hasAddress } from "../bundle/address";
import { pixelShare } from "../render/pixel_share";
import { AddressBar, follows, type Opened } from "./address_bar";
import { OfflinePart } from "./offline_part";
import type { Viewer } from "./viewer";

const FEWER_PIXELS = "Drawn with fewer pixels until this tab is closed.";

export type Later = Readonly<{
  /** null: the address stays as it is. */
  addressBar: AddressBar | null;
}>;

/**
 * @param opened the view that the address has opened
 * @param keptToo addresses of files that are kept for a visit without a network, though the page does not fetch them
 */
export function startLater(
  viewer: Viewer,
  opened: Opened,
  say: (text: string) => void,
  keptToo: readonly string[],
): Later {
  if (pixelShare() < 1) say(FEWER_PIXELS);
  void OfflinePart.start(viewer, say, keptToo);
  const isFollowed = hasAddress() && follows(location.search, window.parent !== window);
  return { addressBar: isFollowed ? new AddressBar(viewer, opened) : null };
}
