/**
 * Colours to choose from, sRGB. The first palette has the usual colours of dyes. The colours of the
 * second can be distinguished without red or green: Okabe & Ito, "Color Universal Design", 2008,
 * without their black, which would be invisible on a dark ground.
 */
import { fromHex, type Rgb, toHex, toOklab } from "../math/color";
import type { Palette } from "./controls";

export const PALETTES: readonly Palette[] = [
  {
    name: "Dyes",
    colors: [
      { name: "DAPI, Hoechst: blue", hex: "#2a5cff" },
      { name: "CFP: cyan", hex: "#00c8ff" },
      { name: "FITC, GFP: green", hex: "#00e000" },
      { name: "YFP: yellow", hex: "#e8e000" },
      { name: "TRITC, Cy3: orange-red", hex: "#ff5a1e" },
      { name: "Texas Red: red", hex: "#ff1e1e" },
      { name: "Cy5: magenta", hex: "#ff28dc" },
      { name: "Transmitted light: white", hex: "#ffffff" },
    ],
  },
  {
    name: "Colour-blind safe",
    colors: [
      { name: "orange", hex: "#e69f00" },
      { name: "sky blue", hex: "#56b4e9" },
      { name: "bluish green", hex: "#009e73" },
      { name: "yellow", hex: "#f0e442" },
      { name: "blue", hex: "#0072b2" },
      { name: "vermilion", hex: "#d55e00" },
      { name: "reddish purple", hex: "#cc79a7" },
      { name: "white", hex: "#ffffff" },
    ],
  },
];

const ALL = PALETTES.flatMap(({ colors }) => colors.map(({ hex }) => hex));

/** Returns the name of a palette's colour, or the hexadecimal digits of any other colour. */
export function nameOfColour(hex: string): string {
  const found = PALETTES.flatMap(({ colors }) => colors).find((each) => each.hex === hex);
  return found?.name ?? hex;
}

/** Returns the next colour of the palettes; for any other colour, the first one. */
export function nextColour(hex: string): string {
  return ALL[(ALL.lastIndexOf(hex) + 1) % ALL.length];
}

/** Number of colours that are offered for a channel. */
const OFFERED = 8;
/** Smallest distance in Oklab at which two signals of an image have clearly different colours. */
const APART = 0.12;
/** Number of further hues, for bundles whose channels already use the colours of the palettes. */
const HUES = 24;

/**
 * Returns eight colours that no other channel has: the colour-blind safe ones first, then the dyes,
 * then further hues. With many channels, it returns the
 * colours that are farthest from all others.
 *
 * @param others colours of the other channels, #rrggbb
 */
export function freeColours(others: readonly string[]): readonly string[] {
  const taken = others.map((hex) => toOklab(fromHex(hex)));
  const hues = Array.from({ length: HUES }, (_, i) => hueOf(i / HUES));
  const candidates = [...[...PALETTES].reverse().flatMap(hexesOf), ...hues];
  const chosen: string[] = [];
  const distance = (hex: string, from: readonly Rgb[]) => {
    const own = toOklab(fromHex(hex));
    return Math.min(Infinity, ...from.map((lab) => Math.hypot(...own.map((v, i) => v - lab[i]))));
  };
  for (let apart = APART; chosen.length < OFFERED; apart /= 2) {
    for (const hex of candidates) {
      const against = [...taken, ...chosen.map((each) => toOklab(fromHex(each)))];
      if (chosen.length < OFFERED && distance(hex, against) > apart) chosen.push(hex);
    }
  }
  return chosen;
}

/** Returns the next colour that no other channel has. */
export function nextFreeColour(hex: string, others: readonly string[]): string {
  const free = freeColours(others);
  return free[(free.indexOf(hex) + 1) % free.length];
}

function hexesOf({ colors }: Palette): readonly string[] {
  return colors.map(({ hex }) => hex);
}

/** Returns a strong, light colour of the colour circle. @param turn 0..1 */
function hueOf(turn: number): string {
  const part = (shift: number) => 0.5 + 0.5 * Math.cos(2 * Math.PI * (turn - shift));
  return toHex([part(0), part(1 / 3), part(2 / 3)]);
}
