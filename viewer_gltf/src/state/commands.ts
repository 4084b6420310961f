/**
 * The requests of a panel or a key that are no change of the state. A part has a list of its own in its definition, and
 * adds the names by `declare module`.
 */
export const OWN_COMMANDS = [
  /** The whole specimen from the front again, and no tile isolated. */
  "reset",
  /** One step out: from an isolated tile to all, from a selected one to none. */
  "back",
  /** One step of the history back, or on again. */
  "undo",
  "redo",
  /** Asks again for all that has failed. */
  "retry",
  /** A tap in the middle of the view: for hands that have only keys. */
  "press",
  /** Stereo in a headset, or back to the page. */
  "stereo",
  /** Stereo, or one picture on a phone, with the user's own room behind the specimen. */
  "room",
  /** Split screen for a phone in a viewer without WebXR. */
  "split",
  /** Reads the phone viewer's code by the camera. */
  "scan",
  /** Measures how large the screen is, by a card that is held to it. */
  "measure-screen",
  /** The page on the full screen, or back in its window. */
  "full-screen",
  "share",
  /** To the panel's search among the channels that are not shown. */
  "find",
  /** Lights the traced picture by a .hdr or .exr file. */
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

/** Names of commands: those above and those of the parts. */
export interface CommandNames extends Record<(typeof OWN_COMMANDS)[number], true> {}

export type Command = keyof CommandNames;

/** Why a command of the flat view has left it as it was. */
export const STAYS: Partial<Record<Command, string>> = {
  front: "The specimen is seen from the front already.",
  side: "The specimen is seen from the side already.",
  top: "The specimen is seen from the top already.",
  reset: "The view is as it was at the opening already.",
  "zoom-in": "This is as near as the view goes.",
  "zoom-out": "This is as far as the view goes.",
  "turn-up": "The specimen is seen from the top: it turns no further up.",
  "turn-down": "The specimen is seen from below: it turns no further down.",
  "pan-left": "The view moves no further: its middle stays in the specimen.",
  "pan-right": "The view moves no further: its middle stays in the specimen.",
  "pan-up": "The view moves no further: its middle stays in the specimen.",
  "pan-down": "The view moves no further: its middle stays in the specimen.",
};

/** The announcement where the viewer can't do what was asked for. */
export const CANT = "This viewer can't do that here.";
