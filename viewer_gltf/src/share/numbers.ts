/** Numbers in an address: short when written, harmless when read. Pure. */

/** Largest number in a view: um of a metre-sized specimen, or metres of the room. */
const LARGEST = 1e7;
const DIGITS = 6;
/** Numbers below this are 0 (um of the specimen, m of the room): a turn's rounding leaves them. */
const NOTHING = 1e-6;

export function written(values: readonly number[]): string {
  const text = (value: number) => String(Number(value.toPrecision(DIGITS)));
  return values.map((value) => (Math.abs(value) < NOTHING ? "0" : text(value))).join(",");
}

/** Exactly so many numbers, all finite; null: anything else. */
export function readNumbers(text: string, count: number): readonly number[] | null {
  const parts = text.split(",", count + 1);
  if (parts.length !== count) return null;
  if (!parts.every((part) => /^-?\d{1,12}(\.\d{1,20})?(e-?\d{1,2})?$/.test(part))) return null;
  const values = parts.map(Number);
  return values.every((value) => Math.abs(value) <= LARGEST) ? values : null;
}
