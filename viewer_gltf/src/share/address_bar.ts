/**
 * The page's address follows the view, so that a reload brings the view back.
 *
 * The address changes once the view has been the same for two looks in a row, half a second apart. That is at most
 * once a second; Safari refuses more than a hundred changes in 30 s.
 */

import type { PartHost } from "../host/part";
import type { CameraView } from "../state/camera_view";
import { initialState } from "../state/initial_state";
import { reduce } from "../state/reduce";
import type { ViewerState } from "../state/viewer_state";
import { isOwnAddress, isPassingStep, keepTyped, writeAddress } from "./address";
import { linkOf } from "./link_of";
import { settingsOf, standOf } from "./page_parameters";
import { readLink } from "./permalink";
import { untypedNames } from "./untyped_names";

const LOOK_MS = 500;

/** `camera`: null where the specimen is seen as the page opens without a link. */
type Seen = Readonly<{ state: ViewerState; camera: CameraView | null }>;
/** The view that the address has opened, before anybody changed it. */
export type Opened = Seen;

/** A link that looks from somewhere. */
const HAS_CAMERA = /[#&]eye=/;

/** Whether the address of a page follows its view: not that of a mere picture in another page. Pure. */
export function follows(search: string, isFramed: boolean): boolean {
  const asked = new URLSearchParams(search);
  const isPicture = isFramed && asked.get("panel") === "off";
  return asked.get("address") === "on" || (asked.get("address") !== "off" && !isPicture);
}

function isSame(a: Seen, b: Seen): boolean {
  return a.state === b.state && JSON.stringify(a.camera) === JSON.stringify(b.camera);
}

export class AddressBar {
  private readonly timer = setInterval(() => this.look(), LOOK_MS);
  /** The view at the last look. */
  private seen: Seen;
  /** The view that the address has. */
  private written: Seen;
  /** The link to the view that the page has opened with, and what stood in the address then. */
  private readonly opening: Readonly<{ link: string; hash: string }>;

  constructor(
    private readonly host: PartHost,
    { state, camera }: Opened,
  ) {
    const { hash } = location;
    // a page that was loaded again in the split screen is left in its step of the history
    if (!host.isInRoom && isPassingStep()) history.replaceState(null, "");
    this.seen = this.now;
    this.written = { state, camera: HAS_CAMERA.test(hash) ? camera : null };
    this.opening = { link: this.linkTo(this.written), hash };
  }

  /** Bring the address to the view at once, as before a reload. */
  write(): void {
    const { now } = this;
    if (this.host.isInRoom || isPassingStep() || !isOwnAddress()) return;
    this.written = now;
    const link = this.linkTo(now);
    const isOpening = link === this.opening.link;
    const names = untypedNames(now.state.measurements);
    const open = this.linkTo({ ...now, state: { ...now.state, measurements: names } });
    const address = new URL(location.href);
    address.hash = isOpening ? this.opening.hash : open;
    if (!this.isRead(open)) return;
    try {
      if (address.hash !== location.hash) writeAddress(address);
      if (!isOpening) keepTyped(link === open ? null : link);
    } catch (error) {
      if (!(error instanceof DOMException)) throw error;
      clearInterval(this.timer); // this document has no address that could change
    }
  }

  dispose(): void {
    clearInterval(this.timer);
  }

  private look(): void {
    const { now, seen } = this;
    this.seen = now;
    if (isSame(now, seen) && !isSame(now, this.written)) this.write();
  }

  private get now(): Seen {
    const { state, viewpoint } = this.host;
    const { cameraView: camera, standing } = viewpoint;
    const home = standOf(location.search) ?? "opening";
    const isHome = standing === home && (camera?.specimen ?? null) === null;
    return { state, camera: isHome ? null : camera };
  }

  /** The state in which the page opens with what stands before the `#`. */
  private get start(): ViewerState {
    const start = initialState(this.host.bundle.manifest);
    return settingsOf(location.search).reduce(reduce, start);
  }

  private linkTo(seen: Seen): string {
    return linkOf(this.host, this.start, seen);
  }

  /** Whether the viewer reads all of a link: one that is too long is no use. */
  private isRead(link: string): boolean {
    const { bundle, state } = this.host;
    const { actions } = readLink(link, state, bundle.manifest.specimen.bounds_um);
    return actions.every(({ type }) => type !== "notify");
  }
}
