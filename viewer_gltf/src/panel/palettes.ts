/**
 * Colours to choose from, sRGB. The field's go by the dye that is usually shown so; the others can
 * be distinguished without red or green: Okabe & Ito, "Color Universal Design", 2008 (their black
 * would not show on a dark ground).
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

/** The name of a palette's colour; of any other, its hexadecimal digits. */
export function nameOfColour(hex: string): string {
  const found = PALETTES.flatMap(({ colors }) => colors).find((each) => each.hex === hex);
  return found?.name ?? hex;
}

/** The palettes' next colour; of any other, the first. */
export function nextColour(hex: string): string {
  return ALL[(ALL.lastIndexOf(hex) + 1) % ALL.length];
}

/** Colours to recolour a channel by: so many are offered. */
const OFFERED = 8;
/** Distance in Oklab at which two colours are told apart at a glance, as signals in one picture are. */
const APART = 0.12;
/** More colours, where the others of a bundle with many channels take up the palettes. */
const HUES = 24;

/**
 * Eight colours that no other channel has: of the palettes first, the colour-blind safe ones before the
 * dyes, then of the circle of hues. With many channels the farthest from all of theirs.
 *
 * @param others the other channels' colours, #rrggbb
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

/** The next colour that no other channel has. */
export function nextFreeColour(hex: string, others: readonly string[]): string {
  const free = freeColours(others);
  return free[(free.indexOf(hex) + 1) % free.length];
}

function hexesOf({ colors }: Palette): readonly string[] {
  return colors.map(({ hex }) => hex);
}

/** A strong, light colour of the circle. @param turn 0..1 */
function hueOf(turn: number): string {
  const part = (shift: number) => 0.5 + 0.5 * Math.cos(2 * Math.PI * (turn - shift));
  return toHex([part(0), part(1 / 3), part(2 / 3)]);
}
