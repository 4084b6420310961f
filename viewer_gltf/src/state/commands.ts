/** The requests of a panel or a key that are no change of the state. */
export type Command =
  /** The whole specimen from the front again, and no tile isolated. */
  | "reset"
  /** One step out: from an isolated tile to all, from a selected one to none. */
  | "back"
  | "stereo"
  /** The page on the full screen, or back in its window. */
  | "full-screen"
  /** Stereo, or one picture on a phone, with the user's own room behind the specimen. */
  | "room"
  /** One step of the history back, or on again. */
  | "undo"
  | "redo"
  /** Split screen for a phone in a viewer without WebXR. */
  | "split"
  /** Read the phone viewer's code by the camera. */
  | "scan"
  | "share"
  /** The measurements as a file. */
  | "save-csv"
  /** The objects of a label map that are selected, or that show, as a file. */
  | "save-objects"
  /** What the screen shows, as large as is chosen. */
  | "save-picture"
  /** Once round, or through the views that were kept; once more: leave it. */
  | "save-video"
  | "keep-view"
  | "next-view"
  | "forget-views"
  /** Ask again for all that has failed. */
  | "retry"
  /** A tap in the middle of the view: for hands that have only keys. */
  | "press"
  /** To the panel's search among the channels that are not shown. */
  | "find"
  /** How large the screen is, by a card that is held to it. */
  | "measure-screen"
  /** Light the traced picture by a .hdr or .exr file. */
  | "own-light"
  | "front"
  | "side"
  | "top"
  | "zoom-in"
  | "zoom-out"
  | "turn-left"
  | "turn-right"
  | "turn-up"
  | "turn-down"
  | "pan-left"
  | "pan-right"
  | "pan-up"
  | "pan-down";

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
  "next-view": "That is the only kept view.",
};

/** The announcement where the viewer can't do what was asked for. */
export const CANT = "This viewer can't do that here.";
