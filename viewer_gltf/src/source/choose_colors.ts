/**
 * Chooses the colours of channels: those that the source states, otherwise colours for the kind of volume, otherwise
 * colours of a palette. No two channels get nearly the same colour.
 *
 * Follows `choose_colors` of pipeline/stereocell/planning/channel_colors.py. It does not look for
 * the names of dyes or of autofluorescence.
 */
import { fromHex, type Rgb } from "../math/color";
import type { Kind } from "./find_window";

/** The same colours as PALETTE of planning/channels.py. */
const PALETTE: readonly Rgb[] = "#4f70f5 #f0cd3c #b4566e #92ecf6 #f6f0dc #a0562c #3f8ca0 #b4c078"
  .split(" ")
  .map(fromHex);
const SKIN: Rgb = [0.72, 0.5, 0.37];
const MR_GREY: Rgb = [0.92, 0.88, 0.82];
const WARM_GREY: Rgb = [0.62, 0.58, 0.52];
/** Colour of a single channel of stained cells. */
const STAIN = fromHex("#5cd6e8");
/** Largest voxel spacing, um, at which a microscope's volume is assumed to show stained cells. */
const STAINED_UM = 10;
/** Linear component, 0..1. A colour whose components are all below this can't be seen on a dark background. */
const BLACK = 0.01;
/** Distance in CIELab below which two colours are hard to tell apart. */
const NEAR = 12;

/** @param stated linear RGB of each channel; null: the source states none */
export function chooseColors(
  stated: readonly (Rgb | null)[],
  modality: Kind["modality"],
  finest_um: number,
): readonly Rgb[] {
  const ofStain = finest_um <= STAINED_UM ? STAIN : WARM_GREY;
  const lone = stated.length === 1 && modality === "" ? ofStain : null;
  const chosen = new Map<number, Rgb>();
  const rounds: readonly ((place: number) => readonly (Rgb | null)[])[] = [
    (place) => [stated[place]],
    (place) => [place === 0 ? ofModality(modality) : null, lone],
    (place) => {
      const turn = place % PALETTE.length;
      return [...PALETTE.slice(turn), ...PALETTE.slice(0, turn)];
    },
  ];
  for (const candidates of rounds) {
    for (const place of stated.keys()) {
      if (chosen.has(place)) continue;
      const free = candidates(place).find(
        (color) =>
          color !== null && Math.max(...color) > BLACK && !isNear(color, [...chosen.values()]),
      );
      if (free) chosen.set(place, free);
    }
  }
  return stated.map((_, place) => chosen.get(place) ?? PALETTE[place % PALETTE.length]);
}

function ofModality(modality: Kind["modality"]): Rgb | null {
  if (modality === "") return null;
  return modality === "MR" ? MR_GREY : SKIN;
}

function isNear(color: Rgb, others: readonly Rgb[]): boolean {
  const lab = toLab(color);
  return others.some((other) => Math.hypot(...toLab(other).map((v, i) => v - lab[i])) < NEAR);
}

/** CIELab under D50 (CIE 15) of linear sRGB (IEC 61966-2-1), adapted by Bradford's matrix. */
function toLab([r, g, b]: Rgb): Rgb {
  const [x, y, z] = [
    (0.4360747 * r + 0.3850649 * g + 0.1430804 * b) / 0.9642,
    0.2225045 * r + 0.7168786 * g + 0.0606169 * b,
    (0.0139322 * r + 0.0971045 * g + 0.7141733 * b) / 0.8249,
  ].map((share) =>
    share > (6 / 29) ** 3 ? Math.cbrt(share) : share / (3 * (6 / 29) ** 2) + 4 / 29,
  );
  return [116 * y - 16, 500 * (x - y), 200 * (y - z)];
}
