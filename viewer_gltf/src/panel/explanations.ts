/**
 * What each setting does, and what one will see of each choice, in plain words. A part of the code by itself, loaded
 * when somebody first asks. Pure.
 */
import { PRESET_SENTENCES } from "../bundle/generated/preset_sentences";
import { OWN } from "../state/transfer_functions_2d";

/** By the last part of a control's ID. */
export const EXPLANATIONS: Readonly<Record<string, string>> = {
  mode: "Where the specimen shows its surfaces, and where its volumes.",
  "switch-distance":
    "From nearer than this, the focus disc or the tile shows the volume. From farther away it shows surfaces.",
  "disc-radius":
    "Half of the angle that the round window in the middle of the view takes. Volumes show inside it. At most twelve tiles show as volumes in it.",
  compositing: "How things that lie behind one another appear.",
  "depth-shading":
    "Enclosed places are darker, and things that lie before others throw shadows on them.",
  volume: "A channel whose volume is off stays a surface in every mode.",
  "transfer-function": "Which values of the volume are visible, and how dense they look.",
  opacity: "How dense the channel looks, as a surface and as a volume.",
  window: "The values that are darkest and brightest. A narrower window has more contrast.",
  tool: "The effect of a click, a tap or a resting gaze on the specimen.",
  "measure-kind": "The kind of the next measurement.",
  quality: "How finely volumes are drawn while the view moves.",
  dwell: "In stereo, looking at something for 1.5 s is the same as pressing a button.",
  "eye-distance":
    "The distance between your pupils, for the split screen. A headset knows its own.",
  "stereo-strength": "100 % is as your eyes see it. At 0 % both eyes see the same.",
  "specimen-size": "The length of the specimen's longest edge in stereo.",
  letters: "If this is off, only ?, the arrows, Escape and keys with Ctrl work.",
};

/** Explanations of each choice, by the last part of the control's ID and the choice. */
export const CHOICES: Readonly<Record<string, Readonly<Record<string, string>>>> = {
  mode: {
    disc: "Surfaces from afar. From near, a round window in the middle shows the volume.",
    tile: "Surfaces from afar. From near, the tile that you chose or look at shows its volume.",
    all: "Translucent volumes in every tile, from any distance.",
    stage: "Each tile as an artist has set it: surface, volume or both.",
    traced:
      "Path tracing: volumes with soft shadows, as in a photograph. The picture clears up at rest.",
    off: "Surfaces alone, which draw fastest.",
  },
  compositing: {
    over: "Things in front veil the things behind them.",
    maximum: "Only the brightest place behind each point shows, as in a maximum projection.",
    sum: "The light of all places adds up, as in an X-ray, and nothing veils.",
  },
  "transfer-function": {
    ...PRESET_SENTENCES,
    [OWN]: "The shapes that you drew in the plane of value and gradient.",
  },
  tool: {
    select: "A card names what lies there, and hides, recolours or isolates it.",
    measure: "Each point adds to a length, an angle or a line.",
  },
  "measure-kind": {
    distance: "The length between two points.",
    angle: "The angle at the second of three points.",
    line: "The length of a line through several points.",
  },
  quality: {
    auto: "As finely as this device can draw in time.",
    low: "Coarse, for slow devices.",
    high: "As finely as possible, however slowly.",
  },
};

/** Explains a choice that the table lacks: the bundle's author has named it. */
const OF_THE_BUNDLE = "A transfer function that came with this bundle.";

const lastPart = (id: string) => id.slice(id.lastIndexOf("/") + 1);

export function explanationOf(id: string): string {
  return EXPLANATIONS[lastPart(id)] ?? "";
}

/** Returns the explanation of a choice; "" if it needs none. */
export function explanationOfChoice(id: string, value: string): string {
  const part = lastPart(id);
  if (part !== "transfer-function") return CHOICES[part]?.[value] ?? "";
  const text = CHOICES[part][value];
  if (text === undefined) return OF_THE_BUNDLE;
  return value === OWN ? text : `${text} Its name in the stage is "${value}".`;
}
