/**
 * A channel's two-dimensional transfer functions as the state has them: what the bundle brought and
 * what a user has made of it. Plain data and pure functions; see docs/transfer-functions.md.
 */

import {
  faultOf,
  MAX_SHAPES,
  type Range,
  type Shape,
  type Shapes,
  type Transfer2d,
} from "../bundle/transfer_2d";
import { fromHex, toHex } from "../math/color";
import { MIN_HEIGHT, MIN_WIDTH } from "./transfer_shapes";

/** The function that a user's shapes make of a channel that is shown by a one-dimensional one. */
export const OWN = "own";
/**
 * Places in the joint histogram, opacities and softness are whole multiples of one part of so many, so that a
 * link holds them exactly: a quarter of the table's columns, two characters of base 36.
 */
export const STEPS = 1020;

export type Functions = Readonly<{
  transferFunction: string;
  transferFunctions: readonly string[];
  /** Of these, the bundle's two-dimensional ones. */
  transferFunctions2d: readonly string[];
  /** null: it has not come, as it is asked for only when something needs it. */
  transfer2d: Transfer2d | null;
  /** The user's own versions of functions, by name. */
  shapes: Readonly<Record<string, Shapes>>;
}>;

function own<T>(record: Readonly<Record<string, T>>, name: string): T | undefined {
  return Object.hasOwn(record, name) ? record[name] : undefined;
}

/** The shapes of a function; none: it is one-dimensional, or the bundle's have not come. */
export function shapesOf(functions: Functions, name = functions.transferFunction): Shapes {
  const { shapes, transfer2d } = functions;
  return (
    own(shapes, name) ?? (transfer2d === null ? undefined : own(transfer2d.functions, name)) ?? []
  );
}

/** Whether a function has shapes, also such as have not come. */
export function isTwoD(functions: Functions, name = functions.transferFunction): boolean {
  const made = own(functions.shapes, name);
  return made === undefined
    ? functions.transferFunctions2d.includes(name)
    : made.length > 0 || name === OWN;
}

/** The function that an editor changes: the chosen one, if it has shapes, or the user's own. */
export function editedName(functions: Functions): string {
  return isTwoD(functions) ? functions.transferFunction : OWN;
}

/** The functions with other shapes in one of them, which is chosen; the same if it can't be. */
export function withShapes<F extends Functions>(functions: F, name: string, shapes: Shapes): F {
  const { transferFunctions } = functions;
  const isKnown = transferFunctions.includes(name);
  if (!isKnown && name !== OWN) return functions;
  const kept = shapes.map(onLattice).flatMap((shape) => shape ?? []);
  return {
    ...functions,
    transferFunctions: isKnown ? transferFunctions : [...transferFunctions, name],
    transferFunction: name,
    shapes: { ...functions.shapes, [name]: kept.slice(0, MAX_SHAPES) },
  };
}

const rounded = (x: number) => Math.round(x * STEPS) / STEPS;

/** Rounded so that it still has its least size. */
function roundedRange([low, high]: Range, least: number): Range {
  const steps = Math.ceil(least * STEPS - 1e-9);
  const from = Math.min(Math.round(low * STEPS), STEPS - steps);
  const to = Math.max(Math.round(high * STEPS), from + steps);
  return [from / STEPS, to / STEPS];
}

/** The shape in such numbers as a link holds; null: it is none. */
export function onLattice(shape: Shape): Shape | null {
  if (faultOf(shape) !== null) return null;
  return {
    kind: shape.kind,
    values: roundedRange(shape.values, MIN_WIDTH),
    gradients: roundedRange(shape.gradients, MIN_HEIGHT),
    tip: rounded(shape.tip),
    color: fromHex(toHex(shape.color)),
    opacity: rounded(shape.opacity),
    softness: rounded(shape.softness),
  };
}
