/** A two-dimensional transfer function of a bundle: its shapes, and the size of its tables. Pure. */
import type { ChannelTransfer2D } from "./generated/transfer2d";

export const ROWS = 64;
export const COLUMNS = 256;
export const MAX_SHAPES = 32;

export type Range = readonly [number, number];
export type ShapeKind = "rectangle" | "triangle";

/** A shape, described in transfer2d.schema.json; all numbers are 0..1. */
export type Shape = Readonly<{
  kind: ShapeKind;
  values: Range;
  gradients: Range;
  tip: number;
  color: readonly [number, number, number];
  opacity: number;
  softness: number;
}>;
export type Shapes = readonly Shape[];

/**
 * A channel's two-dimensional functions and the numbers that describe their axes, from transfer2d.json; without the
 * histogram.
 */
export type Transfer2d = Readonly<Omit<ChannelTransfer2D, "functions" | "histogram" | "most">> &
  Readonly<{ functions: Readonly<Record<string, Shapes>> }>;

/** Returns the fault of a shape from a file or a link; null if it has none. */
export function faultOf(shape: Shape): string | null {
  if (shape.kind !== "rectangle" && shape.kind !== "triangle")
    return `kind is ${shape.kind}, expected rectangle or triangle`;
  for (const name of ["values", "gradients"] as const) {
    const [low, high] = shape[name];
    if (!(0 <= low && low < high && high <= 1)) {
      return `${name} are (${low}, ${high}), expected two rising numbers within 0..1`;
    }
  }
  const numbers = { tip: shape.tip, opacity: shape.opacity, softness: shape.softness };
  const [r, g, b] = shape.color;
  for (const [name, number] of Object.entries({ ...numbers, red: r, green: g, blue: b })) {
    if (!(0 <= number && number <= 1)) return `${name} is ${number}, expected 0..1`;
  }
  return null;
}
