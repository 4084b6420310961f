/** Lengths as text, in nm, um or mm. */
const DIGITS = 3;

/**
 * Returns the unit in which a length is written, and the factor from um to it: mm from 1000 um on,
 * nm below 1 um, otherwise um.
 */
function lengthUnitOf(rounded_um: number): readonly [string, number] {
  return rounded_um >= 1000 ? ["mm", 1e-3] : rounded_um < 1 ? ["nm", 1e3] : ["µm", 1];
}

/** Edges in the unit of the longest one: `231 × 215 × 255 mm`. */
export function sizeText(edges_um: readonly number[]): string {
  const rounded = edges_um.map((edge) => Number(edge.toPrecision(DIGITS)));
  const [unit, factor] = lengthUnitOf(Math.max(...rounded));
  const texts = rounded.map((edge) => String(Number((edge * factor).toPrecision(DIGITS))));
  return `${texts.join(" × ")} ${unit}`;
}

/** A distance with three digits, which is more than a hand can point at. */
export function distanceText(distance_um: number): string {
  const rounded = Number(distance_um.toPrecision(DIGITS)); // so 999.9 um becomes 1.00 mm
  if (rounded === 0) return "0 µm";
  const [unit, factor] = lengthUnitOf(rounded);
  const value = distance_um * factor;
  const whole = Math.floor(Math.log10(rounded * factor) + 1e-9) + 1;
  return `${value.toFixed(Math.max(0, DIGITS - Math.max(1, whole)))} ${unit}`;
}
