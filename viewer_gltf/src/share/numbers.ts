/** Writes numbers of an address in short form, and checks them when it reads them. Pure. */

/** Largest number in a view: um of a specimen ten metres long, or metres of the scene. */
const LARGEST = 1e7;
const DIGITS = 6;
/** Numbers below this (um of the specimen, m of the scene) count as 0; they come from rounding in rotations. */
const NOTHING = 1e-6;

export function written(values: readonly number[]): string {
  const text = (value: number) => String(Number(value.toPrecision(DIGITS)));
  return values.map((value) => (Math.abs(value) < NOTHING ? "0" : text(value))).join(",");
}

/** Reads exactly `count` finite numbers; null for any other text. */
export function readNumbers(text: string, count: number): readonly number[] | null {
  const parts = text.split(",", count + 1);
  if (parts.length !== count) return null;
  if (!parts.every((part) => /^-?\d{1,12}(\.\d{1,20})?(e-?\d{1,2})?$/.test(part))) return null;
  const values = parts.map(Number);
  return values.every((value) => Math.abs(value) <= LARGEST) ? values : null;
}
