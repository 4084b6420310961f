import { type Key, type KeyGroup, key, keysOf, neighbour, no } from "../panel/key";
import { LENSES } from "../panel/lenses";
import { SCREEN_STEREO, STEREO_PARAMETERS } from "../state/parameters/tools";

const KEYS: readonly Key[] = [
  key("V", "Enter stereo (VR), or leave it", "stereo"),
  key("Home", "View in your room (AR), or leave it", "room"),
  key("L", "Next lens profile of a Cardboard viewer", ({ view }) => {
    const lenses = neighbour(LENSES, view.lenses, 1);
    return lenses === null ? no("There is no Cardboard viewer.") : { panel: "lenses", lenses };
  }),
  key("P", "Split screen for a Cardboard viewer", "split"),
  key("K", "Scan the Cardboard viewer's code", "scan"),
  key(":", "Measure the screen with a card, for the split screen", "measure-screen"),
  ...[SCREEN_STEREO, ...STEREO_PARAMETERS].flatMap(keysOf),
];

/** In the list of keys these follow the keys of the flat view. */
export const STEREO_KEYS: readonly KeyGroup[] = [{ name: "View", rank: 11, keys: KEYS }];
