/**
 * Colours to choose from, sRGB. The field's go by the dye that is usually shown so; the others can
 * be distinguished without red or green: Okabe & Ito, "Color Universal Design", 2008 (their black
 * would not show on a dark ground).
 */
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

/** The palettes' next colour; of any other, the first. */
export function nextColour(hex: string): string {
  return ALL[(ALL.lastIndexOf(hex) + 1) % ALL.length];
}
