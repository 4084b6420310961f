/**
 * A channel's two-dimensional transfer functions: those of the bundle and the user's edits. Plain
 * data and pure functions; see docs/transfer-functions.md.
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

/** Name of the function that a user's shapes make for a channel with a one-dimensional function. */
export const OWN = "own";
/**
 * Places in the joint histogram, opacities and softness are whole multiples of 1 / STEPS. A link
 * then holds them exactly in two characters of base 36. Each column of the table has four steps.
 */
export const STEPS = 1020;

export type Functions = Readonly<{
  transferFunction: string;
  transferFunctions: readonly string[];
  /** The two-dimensional functions of the bundle. */
  transferFunctions2d: readonly string[];
  /**
   * Content of the bundle's two-dimensional functions; null: not fetched yet. It is fetched when
   * something needs it.
   */
  transfer2d: Transfer2d | null;
  /** The user's own versions of functions, by name. */
  shapes: Readonly<Record<string, Shapes>>;
}>;

function ownValue<T>(record: Readonly<Record<string, T>>, name: string): T | undefined {
  return Object.hasOwn(record, name) ? record[name] : undefined;
}

/** Returns the shapes of a function; none if it is one-dimensional, or not fetched yet. */
export function shapesOf(functions: Functions, name = functions.transferFunction): Shapes {
  const { shapes, transfer2d } = functions;
  return (
    ownValue(shapes, name) ??
    (transfer2d === null ? undefined : ownValue(transfer2d.functions, name)) ??
    []
  );
}

/** Returns whether a function has shapes, even if they are not fetched yet. */
export function isTwoD(functions: Functions, name = functions.transferFunction): boolean {
  const made = ownValue(functions.shapes, name);
  return made === undefined
    ? functions.transferFunctions2d.includes(name)
    : made.length > 0 || name === OWN;
}

/** Returns the function that an editor changes: the chosen one if it has shapes, else the user's own. */
export function editedName(functions: Functions): string {
  return isTwoD(functions) ? functions.transferFunction : OWN;
}

/**
 * Returns the functions with other shapes in one of them, which becomes the chosen one. An unknown
 * name changes nothing.
 */
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

/**
 * Rounds both ends of a range to multiples of 1 / STEPS, with at least a smallest distance between
 * them.
 */
function roundedRange([low, high]: Range, least: number): Range {
  const steps = Math.ceil(least * STEPS - 1e-9);
  const from = Math.min(Math.round(low * STEPS), STEPS - steps);
  const to = Math.max(Math.round(high * STEPS), from + steps);
  return [from / STEPS, to / STEPS];
}

/** Returns the shape with numbers that a link can hold; null if it is invalid. */
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
