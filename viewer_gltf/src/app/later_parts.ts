/** Parts of the page that nobody needs before the first picture. */
import { hasAddress } from "../bundle/address";
import { isHeld } from "../bundle/held_files";
import type { PartHost } from "../host/part";
import { OfflinePart } from "../offline/part";
import { pixelShare } from "../render/pixel_share";
import { AddressBar, follows, type Opened } from "../share/address_bar";

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
  host: PartHost,
  opened: Opened,
  say: (text: string) => void,
  keptToo: readonly string[],
): Later {
  if (pixelShare() < 1) say(FEWER_PIXELS);
  if (!isHeld(host.bundle.base)) void OfflinePart.start(host, say, keptToo);
  const isFollowed = hasAddress() && follows(location.search, window.parent !== window);
  return { addressBar: isFollowed ? new AddressBar(host, opened) : null };
}
