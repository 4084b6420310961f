/**
 * Requests of a panel or a key that do not change the state. A part lists its own commands in its
 * definition, and adds their names by `declare module`.
 */
export const OWN_COMMANDS = [
  /** Shows the whole specimen from the front, with no tile isolated. */
  "reset",
  /** Shows all tiles again if one is isolated; otherwise deselects the selected tile. */
  "back",
  /** Goes one step back or forward in the history. */
  "undo",
  "redo",
  /** Requests all files again that failed to load. */
  "retry",
  /** Taps the middle of the view, for users of the keyboard. */
  "press",
  /** Enters stereo in a headset, or returns to the page. */
  "stereo",
  /** Shows the specimen in the user's own room, in a headset or on a phone. */
  "room",
  /** Splits the screen of a phone in a Cardboard viewer, without WebXR. */
  "split",
  /** Reads the QR code of a Cardboard viewer with the camera. */
  "scan",
  /** Measures the size of the screen with a bank card on it. */
  "measure-screen",
  /** Shows the page on the full screen, or returns to its window. */
  "full-screen",
  "share",
  /** Moves the focus to the panel's search for channels. */
  "find",
  /** Lights the path-traced image by a .hdr or .exr file of the user. */
  "own-light",
  "front",
  "side",
  "top",
  "zoom-in",
  "zoom-out",
  "turn-left",
  "turn-right",
  "turn-up",
  "turn-down",
  "pan-left",
  "pan-right",
  "pan-up",
  "pan-down",
] as const;

/** Names of all commands: those above and those of the parts. */
export interface CommandNames extends Record<(typeof OWN_COMMANDS)[number], true> {}

export type Command = keyof CommandNames;

/** Reasons why a command of the flat view changed nothing. */
export const UNCHANGED_VIEW: Partial<Record<Command, string>> = {
  front: "The specimen is seen from the front already.",
  side: "The specimen is seen from the side already.",
  top: "The specimen is seen from the top already.",
  reset: "The view is the opening view already.",
  "zoom-in": "The view can't move any closer.",
  "zoom-out": "The view can't move any farther away.",
  "turn-up": "The specimen is seen from the top already.",
  "turn-down": "The specimen is seen from below already.",
  "pan-left": "The view can't move further: its centre stays inside the specimen.",
  "pan-right": "The view can't move further: its centre stays inside the specimen.",
  "pan-up": "The view can't move further: its centre stays inside the specimen.",
  "pan-down": "The view can't move further: its centre stays inside the specimen.",
};

/** Announcement when the viewer cannot do what was requested. */
export const UNAVAILABLE =
  "This command is not available for this specimen, in this browser, or in stereo.";
