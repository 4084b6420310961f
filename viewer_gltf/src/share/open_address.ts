/** Opens the view that the page's address asks for. */
import { BundleError } from "../bundle/errors";
import type { PartHost } from "../host/part";
import { setTo } from "../state/parameters/kinds";
import { isTraced, SWITCH_DISTANCE } from "../state/parameters/volumes";
import { settingsOf, standOf } from "./page_parameters";

/** Smallest volume distance when the page opens, as a multiple of the eye's distance from the specimen's centre. */
const NEAR_AT_START = 1.1;

const NOT_LOADED =
  "The part of the page that reads links could not be loaded. Check the connection and try again.";

/** Reads a link for a state, within the specimen's bounds. */
export type LinkReader = (
  state: Parameters<typeof import("./permalink").readLink>[1],
  bounds_um: Parameters<typeof import("./permalink").readLink>[2],
) => ReturnType<typeof import("./permalink").readLink>;

/** Returns a function that reads a link; its code loads only if there is a link. Rejects with a BundleError. */
export async function loadLink(link: string): Promise<LinkReader> {
  if (link.length < 2) return () => ({ actions: [], camera: null });
  const { readLink } = await import("./permalink").catch((cause) => {
    throw new BundleError(NOT_LOADED, { cause });
  });
  return (state, bounds_um) => readLink(link, state, bounds_um);
}

export function openAddress(host: PartHost, search: string, readLink: LinkReader): void {
  const { viewpoint } = host;
  const { bounds_um } = host.bundle.manifest.specimen;
  const { actions, camera } = readLink(host.state, bounds_um);
  const asked = [...settingsOf(search), ...actions];
  for (const action of asked) host.dispatch(action);
  const hasDistance = asked.some((a) => a.type === "set" && a.id === SWITCH_DISTANCE.id);
  const stand = standOf(search); // the viewpoint to which `reset` returns, also if a link opens another one
  host.display.fit(); // the panel has been laid out by now
  if (stand !== null) viewpoint.openAt(stand);
  else if (camera === null) openSlowly(host, hasDistance);
  if (camera !== null) viewpoint.lookFrom(camera);
  host.panel.show({ channelsWithCard: null });
  host.undo.forget();
}

/** Shows the whole specimen, near enough for volumes to show, and turns it slowly until a user touches it. */
function openSlowly(host: PartHost, hasDistance: boolean): void {
  const { viewpoint } = host;
  const away_m = NEAR_AT_START * viewpoint.openingDistance_m;
  const isFar = away_m > host.state.switchDistance_m;
  if (isFar && !hasDistance) host.dispatch(setTo(SWITCH_DISTANCE, away_m));
  // The path tracer gathers light only while nothing moves.
  const isCalm = matchMedia("(prefers-reduced-motion: reduce)").matches;
  if (!isCalm && !isTraced(host.state)) viewpoint.turnSlowly();
  host.display.redraw();
}
