/**
 * Edits of the shapes of a two-dimensional transfer function: the selected shape, the part that is
 * dragged, and the numbers of a shape. Plain data and pure functions.
 */

import type { Shape, ShapeKind, Shapes } from "../bundle/transfer_2d";
import { toHex } from "../math/color";
import { editedName, type Functions, isTwoD, shapesOf } from "../state/transfer_functions_2d";
import {
  addShape,
  type HistogramPoint,
  hitTest,
  makeShape,
  move,
  type Part,
  replaceShape,
  resize,
} from "../state/transfer_shapes";

/**
 * The selected shape, and the number of shapes when it was selected. If the number has changed, the
 * topmost shape is selected.
 */
export type SelectedShape = Readonly<{ index: number; count: number }>;

/** The part of a shape that a pointer drags, with the place and the shape at the start of the drag. */
export type Grab = Readonly<{ index: number; part: Part; from: HistogramPoint; shape: Shape }>;

/** Smallest drag, as a share of the histogram. Shorter ones are the trembling of a finger. */
const STILL: HistogramPoint = { value: 1 / 255, gradient: 1 / 63 };
/** Intensities of new shapes, 0..1, so that they do not cover each other. */
const PLACES = [0.3, 0.5, 0.7, 0.4, 0.6];

/** Returns the index of the selected shape; null if there are no shapes. */
export function selectedShapeIndex(selected: SelectedShape | null, shapes: Shapes): number | null {
  if (shapes.length === 0) return null;
  return selected?.count === shapes.length ? selected.index : shapes.length - 1;
}

/** Returns the shapes that an editor shows: none while a one-dimensional function is chosen. */
export function editedShapes(functions: Functions): Shapes {
  return isTwoD(functions) ? shapesOf(functions) : [];
}

/**
 * Returns the list to which a new shape is added. If a one-dimensional function is chosen, that is
 * the list of the user's own function.
 */
function editableShapes(functions: Functions): Shapes {
  return shapesOf(functions, editedName(functions));
}

export function withNewShape(functions: Functions, kind: ShapeKind): Shapes {
  const shapes = editableShapes(functions);
  const value = PLACES[shapes.length % PLACES.length];
  return addShape(shapes, makeShape(kind, { value, gradient: 0.4 }));
}

export function grabAt(
  shapes: Shapes,
  at: HistogramPoint,
  reach: HistogramPoint,
  selected: number | null,
): Grab | null {
  const hit = hitTest(shapes, at, reach, selected);
  return hit === null ? null : { ...hit, from: at, shape: shapes[hit.index] };
}

/** Returns the shapes after a drag; null if nothing has changed. */
export function draggedTo(shapes: Shapes, grab: Grab, at: HistogramPoint): Shapes | null {
  const { index, part, from, shape } = grab;
  if (!(index in shapes)) return null;
  const by = { value: at.value - from.value, gradient: at.gradient - from.gradient };
  const isStill = Math.abs(by.value) < STILL.value && Math.abs(by.gradient) < STILL.gradient;
  if (isStill && shapes[index] === shape) return null;
  if (part === "body") return replaceShape(shapes, index, move(shape, by));
  const start = placeOf(shape, part);
  const to = { value: start.value + by.value, gradient: start.gradient + by.gradient };
  return replaceShape(shapes, index, resize(shape, part, to));
}

function placeOf({ values, gradients, tip }: Shape, part: Part): HistogramPoint {
  if (part === "tip") return { value: tip, gradient: 0 };
  return {
    value: values[part.endsWith("right") ? 1 : 0],
    gradient: gradients[part.startsWith("top") ? 1 : 0],
  };
}

/** A number of a shape that keys decrease or increase. */
export type ShapeNumber = Readonly<{
  id: string;
  name: string;
  isOf: (shape: Shape) => boolean;
  by: (shape: Shape, step: number) => Shape;
}>;

const all = () => true;

function edge(id: Part, name: string): ShapeNumber {
  const by = (shape: Shape, step: number) => {
    const { value, gradient } = placeOf(shape, id);
    return resize(shape, id, { value: value + step, gradient: gradient + step });
  };
  return { id, name, isOf: id === "tip" ? ({ kind }) => kind === "triangle" : all, by };
}

function share(id: "opacity" | "softness"): ShapeNumber {
  const by = (shape: Shape, step: number) => ({
    ...shape,
    [id]: Math.min(1, Math.max(0, shape[id] + step)),
  });
  return { id, name: id, isOf: all, by };
}

export const SHAPE_NUMBERS: readonly ShapeNumber[] = [
  {
    id: "value",
    name: "place by value",
    isOf: all,
    by: (shape, step) => move(shape, { value: step, gradient: 0 }),
  },
  {
    id: "gradient",
    name: "place by gradient",
    isOf: all,
    by: (shape, step) => move(shape, { value: 0, gradient: step }),
  },
  edge("left", "lower value"),
  edge("right", "upper value"),
  edge("bottom", "lower gradient"),
  edge("top", "upper gradient"),
  edge("tip", "tip"),
  share("opacity"),
  share("softness"),
];

const ends = ([low, high]: readonly [number, number]) => `${low.toFixed(2)} – ${high.toFixed(2)}`;

/** Describes a shape for users who cannot see it. */
export function shapeText({ kind, values, gradients, opacity, softness, color }: Shape): string {
  const hex = toHex(color);
  return [
    `${kind}: value ${ends(values)}`,
    `gradient ${ends(gradients)}`,
    `opacity ${Math.round(100 * opacity)} %`,
    `softness ${Math.round(100 * softness)} %`,
    ...(hex === "#ffffff" ? [] : [`colour ${hex}`]),
  ].join(", ");
}

/** Returns words for the user on a change of the shapes of a two-dimensional transfer function. */
export function changeText(before: Shapes, after: Shapes): string {
  if (after.length > before.length) return `Added a ${shapeText(after[after.length - 1])}`;
  if (after.length < before.length) return `Removed a shape: ${after.length} left`;
  const changed = after.findIndex((shape, i) => shape !== before[i]);
  const differs = after.findIndex((shape, i) => shapeText(shape) !== shapeText(before[i]));
  const index = differs === -1 ? changed : differs;
  return index === -1 ? "" : `Shape ${index + 1}, ${shapeText(after[index])}`;
}
