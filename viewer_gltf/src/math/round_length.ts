/** A scale bar: a round length that is neither too short nor too long on the screen. */

/**
 * Pixels. Longest bar; the shortest is 0.4 of it, since 2 to 5 is the largest step of round
 * lengths.
 */
export const LONGEST_PX = 160;

export type ScaleBar = Readonly<{ length_um: number; length_px: number; label: string }>;

/**
 * Length of the specimen, um, that one pixel shows at a distance straight ahead of the eye.
 *
 * @param fov_rad vertical field of view
 * @param m_per_um metres of the scene per um of the specimen
 */
export function umPerPixel(
  distance_m: number,
  fov_rad: number,
  height_px: number,
  m_per_um: number,
): number {
  return (2 * distance_m * Math.tan(fov_rad / 2)) / height_px / m_per_um;
}

/**
 * Chooses a length of 1, 2 or 5 times a power of ten. Returns null if the pixel size is not
 * positive and finite, as with the eye at the point itself.
 */
export function chooseScaleBar(um_per_px: number): ScaleBar | null {
  if (!(um_per_px > 0) || !Number.isFinite(um_per_px)) return null;
  const longest_um = LONGEST_PX * um_per_px;
  // The factor keeps exact ties, such as 1000 um at 6.25 um per pixel, from being lost to rounding.
  const fits = (length_um: number) => length_um <= longest_um * (1 + 1e-9);
  let exponent = Math.floor(Math.log10(longest_um));
  while (fits(tenTo(exponent + 1))) exponent++;
  while (!fits(tenTo(exponent))) exponent--;
  const mantissa = [5, 2, 1].find((m) => fits(m * tenTo(exponent))) ?? 1;
  const length_um = mantissa * tenTo(exponent);
  return { length_um, length_px: length_um / um_per_px, label: labelOf(mantissa, exponent) };
}

/** 1 / 1000 is the double nearest to 0.001, but 10 ** -3 is not. */
function tenTo(exponent: number): number {
  return exponent < 0 ? 1 / 10 ** -exponent : 10 ** exponent;
}

/** Returns the text of a length: in mm from 1000 um on, in nm below 1 um, otherwise in um. */
function labelOf(mantissa: number, exponent: number): string {
  const [unit, shift] = exponent >= 3 ? ["mm", -3] : exponent < 0 ? ["nm", 3] : ["µm", 0];
  return `${mantissa * tenTo(exponent + shift)} ${unit}`;
}
