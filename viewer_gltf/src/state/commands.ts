/**
 * The names of the requests of a panel or a key that are no change of the state. A part adds its own names by
 * `declare module`.
 */
export interface CommandNames {
  /** The whole specimen from the front again, and no tile isolated. */
  reset: true;
  /** One step out: from an isolated tile to all, from a selected one to none. */
  back: true;
  /** One step of the history back, or on again. */
  undo: true;
  redo: true;
  /** Asks again for all that has failed. */
  retry: true;
  /** A tap in the middle of the view: for hands that have only keys. */
  press: true;
  /** Stereo in a headset, or back to the page. */
  stereo: true;
  /** Stereo, or one picture on a phone, with the user's own room behind the specimen. */
  room: true;
  /** Split screen for a phone in a viewer without WebXR. */
  split: true;
  /** Reads the phone viewer's code by the camera. */
  scan: true;
  /** Measures how large the screen is, by a card that is held to it. */
  "measure-screen": true;
  /** The page on the full screen, or back in its window. */
  "full-screen": true;
  share: true;
  /** To the panel's search among the channels that are not shown. */
  find: true;
  /** Lights the traced picture by a .hdr or .exr file. */
  "own-light": true;
  front: true;
  side: true;
  top: true;
  "zoom-in": true;
  "zoom-out": true;
  "turn-left": true;
  "turn-right": true;
  "turn-up": true;
  "turn-down": true;
  "pan-left": true;
  "pan-right": true;
  "pan-up": true;
  "pan-down": true;
}

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
