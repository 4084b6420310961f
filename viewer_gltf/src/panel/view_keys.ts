/** The keys of the view. Pure. */
import { type Key, key } from "./key";

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
  key("Ctrl+z", "Undo the last change", "undo"),
  key(["Ctrl+Z", "Ctrl+y"], "Redo the last undone change", "redo"),
  key("Shift+Enter", "Full screen, or back to the window", "full-screen"),
];
