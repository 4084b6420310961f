/**
 * Keeps the page's address equal to a link to the view, so that a reload restores the view.
 *
 * The address changes once two checks in a row, half a second apart, have found the same view. That is at most once a
 * second; Safari refuses more than a hundred changes in 30 s.
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

/** A view; `camera` is null if the camera is where a page without a link opens. */
type Seen = Readonly<{ state: ViewerState; camera: CameraView | null }>;
/** The view that the address has opened, before any change. */
export type Opened = Seen;

/** Matches a link that contains a camera. */
const HAS_CAMERA = /[#&]eye=/;

/** Returns whether a page's address follows its view. A page without a panel in another page's frame does not. Pure. */
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
  /** The view at the last check. */
  private seen: Seen;
  /** The view that the address describes. */
  private written: Seen;
  /** The link to the view that the page has opened with, and the hash of the address at that time. */
  private readonly opening: Readonly<{ link: string; hash: string }>;

  constructor(
    private readonly host: PartHost,
    { state, camera }: Opened,
  ) {
    const { hash } = location;
    // A page that was reloaded in the split screen is still at that step of the history, but no longer split.
    if (!host.isInStereo && isPassingStep()) history.replaceState(null, "");
    this.seen = this.now;
    this.written = { state, camera: HAS_CAMERA.test(hash) ? camera : null };
    this.opening = { link: this.linkTo(this.written), hash };
  }

  /** Updates the address at once, for example before a reload. */
  write(): void {
    const { now } = this;
    if (this.host.isInStereo || isPassingStep() || !isOwnAddress()) return;
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
      clearInterval(this.timer); // the browser does not let this document change its address
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

  /** The state in which the page opens if its address has no link after the `#`. */
  private get start(): ViewerState {
    const start = initialState(this.host.bundle.manifest);
    return settingsOf(location.search).reduce(reduce, start);
  }

  private linkTo(seen: Seen): string {
    return linkOf(this.host, this.start, seen);
  }

  /** Returns whether the viewer can read a link without a notice; it refuses one that is too long. */
  private isRead(link: string): boolean {
    const { bundle, state } = this.host;
    const { actions } = readLink(link, state, bundle.manifest.specimen.bounds_um);
    return actions.every(({ type }) => type !== "notify");
  }
}
