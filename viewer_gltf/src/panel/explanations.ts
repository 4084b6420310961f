/**
 * Explanations of choices: what one will see of each. The sentence on a setting as a whole is in its row. This is a part
 * of the code by itself, which is loaded when somebody first asks. Pure.
 */
import { PRESET_SENTENCES } from "../bundle/generated/preset_sentences";
import { OWN } from "../state/transfer_functions_2d";

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

/** Returns the explanation of a choice; "" if it needs none. */
export function explanationOfChoice(id: string, value: string): string {
  const part = lastPart(id);
  if (part !== "transfer-function") return CHOICES[part]?.[value] ?? "";
  const text = CHOICES[part][value];
  if (text === undefined) return OF_THE_BUNDLE;
  return value === OWN ? text : `${text} Its name in the stage is "${value}".`;
}
