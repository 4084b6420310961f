/** The keys of the view, on the screen and in stereo. Pure. */
import { SCREEN_STEREO, STEREO_PARAMETERS } from "../../state/parameters/tools";
import { type Key, key, keysOf, neighbour, no } from "../key";
import { LENSES } from "./stereo";

export const VIEW_KEYS: readonly Key[] = [
  key("ArrowLeft", "Turn left", "turn-left"),
  key("ArrowRight", "Turn right", "turn-right"),
  key("ArrowUp", "Turn up", "turn-up"),
  key("ArrowDown", "Turn down", "turn-down"),
  key("Shift+ArrowLeft", "Move left", "pan-left"),
  key("Shift+ArrowRight", "Move right", "pan-right"),
  key("Shift+ArrowUp", "Move up", "pan-up"),
  key("Shift+ArrowDown", "Move down", "pan-down"),
  key(["+", "="], "Zoom in", "zoom-in"),
  key("-", "Zoom out", "zoom-out"),
  key("z", "From the front (along z)", "front"),
  key("a", "From the side (along x)", "side"),
  key("y", "From the top (along y)", "top"),
  key("r", "Reset the view", "reset"),
  key("Ctrl+z", "Undo the last change of the view", "undo"),
  key(["Ctrl+Z", "Ctrl+y"], "Redo what was undone", "redo"),
  key("Shift+Enter", "Full screen, or back in the window", "full-screen"),
  key("V", "Enter stereo (VR), or leave it", "stereo"),
  key("Home", "The specimen in your room (AR), or leave it", "room"),
  key("L", "Next phone viewer", ({ view }) => {
    const lenses = neighbour(LENSES, view.lenses, 1);
    return lenses === null ? no("There is no phone viewer.") : { panel: "lenses", lenses };
  }),
  key("P", "Split screen for a phone viewer", "split"),
  key("K", "Scan the phone viewer's code", "scan"),
  key(":", "Measure the screen by a card, for the split screen", "measure-screen"),
  ...[SCREEN_STEREO, ...STEREO_PARAMETERS].flatMap(keysOf),
];
