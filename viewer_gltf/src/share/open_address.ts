/** Opens the view that the page's address asks for. */
import type { PartHost } from "../host/part";
import { setTo } from "../state/parameters/kinds";
import { isTraced, SWITCH_DISTANCE } from "../state/parameters/volumes";
import { withTyped } from "./address";
import { settingsOf, standOf } from "./page_parameters";
import { readLink } from "./permalink";

/** Least switch distance at the opening, as a multiple of the eye's distance from the middle. */
const NEAR_AT_START = 1.1;

export function openAddress(host: PartHost, search: string, hash: string): void {
  const { viewpoint } = host.display;
  const { bounds_um } = host.bundle.manifest.specimen;
  const { actions, camera } = readLink(withTyped(hash), host.state, bounds_um);
  const asked = [...settingsOf(search), ...actions];
  for (const action of asked) host.dispatch(action);
  const saysDistance = asked.some((a) => a.type === "set" && a.id === SWITCH_DISTANCE.id);
  const stand = standOf(search); // what `reset` returns to, wherever a link looks from
  host.display.fit(); // the panel has its place by now
  if (stand !== null) viewpoint.openAt(stand);
  else if (camera === null) openSlowly(host, saysDistance);
  if (camera !== null) viewpoint.lookFrom(camera);
  host.panel.show({ channelsWithCard: null });
  host.undo.forget();
}

/** Shows all of the specimen, near enough for volumes, and slowly turning until someone touches it. */
function openSlowly(host: PartHost, saysDistance: boolean): void {
  const { navigation } = host.display.viewpoint;
  const away_m = NEAR_AT_START * navigation.openingDistance_m;
  const isFar = away_m > host.state.switchDistance_m;
  if (isFar && !saysDistance) host.dispatch(setTo(SWITCH_DISTANCE, away_m));
  // light is gathered while nothing moves
  const isCalm = matchMedia("(prefers-reduced-motion: reduce)").matches;
  if (!isCalm && !isTraced(host.state)) navigation.turnSlowly();
  host.display.redraw();
}
