/**
 * Two-dimensional transfer functions: shapes in the joint histogram of intensity and gradient
 * magnitude, the table that a shader reads, and the edits of an editor. Plain data and pure
 * functions. The table has the same bytes as that of the pipeline's evaluate2d;
 * docs/transfer-functions.md has the formula.
 */
import {
  COLUMNS,
  MAX_SHAPES,
  type Range,
  ROWS,
  type Shape,
  type ShapeKind,
  type Shapes,
} from "../bundle/transfer_2d";

/** Smallest size of a shape, as a share of the histogram's width and height: one cell of the table. */
export const MIN_WIDTH = 1 / (COLUMNS - 1);
export const MIN_HEIGHT = 1 / (ROWS - 1);

/**
 * A place in the histogram: intensity as a share of the window, gradient magnitude as a share of
 * gradient_max.
 */
export type HistogramPoint = Readonly<{ value: number; gradient: number }>;

/** The part of a shape under the pointer. Corners are found before edges, edges before the body. */
export type Part =
  | "tip"
  | "top-left"
  | "top-right"
  | "bottom-left"
  | "bottom-right"
  | "left"
  | "right"
  | "bottom"
  | "top"
  | "body";
export type Hit = Readonly<{ index: number; part: Part }>;

const clamp = (x: number, low: number, high: number) => Math.min(high, Math.max(low, x));

/**
 * Returns the table of a function: RGBA of `rows` x `columns` cells, row 0 (gradient 0) first. RGB
 * is a factor to the channel's colour; A is the opacity of one finest voxel spacing.
 */
export function rasterise(shapes: Shapes, rows = ROWS, columns = COLUMNS): Uint8Array<ArrayBuffer> {
  const table = new Uint8Array(rows * columns * 4);
  const sums = {
    clear: new Float64Array(columns),
    weight: new Float64Array(columns),
    r: new Float64Array(columns),
    g: new Float64Array(columns),
    b: new Float64Array(columns),
  };
  const { clear, weight, r, g, b } = sums;
  for (let j = 0; j < rows; j++) {
    clear.fill(1);
    for (const sum of [weight, r, g, b]) sum.fill(0);
    for (const shape of shapes) addRow(sums, shape, j / (rows - 1), columns);
    for (let k = 0; k < columns; k++) {
      const at = 4 * (j * columns + k);
      const isEmpty = weight[k] === 0;
      table[at] = isEmpty ? 255 : Math.floor(255 * (r[k] / weight[k]) + 0.5);
      table[at + 1] = isEmpty ? 255 : Math.floor(255 * (g[k] / weight[k]) + 0.5);
      table[at + 2] = isEmpty ? 255 : Math.floor(255 * (b[k] / weight[k]) + 0.5);
      table[at + 3] = Math.floor(255 * (1 - clear[k]) + 0.5);
    }
  }
  return table;
}

type Sums = Readonly<Record<"clear" | "weight" | "r" | "g" | "b", Float64Array>>;

/** Adds a shape to one row of the table. */
function addRow({ clear, weight, r, g, b }: Sums, shape: Shape, gradient: number, columns: number) {
  const [bottom, top] = shape.gradients;
  const height = (top - bottom) / 2;
  let depth = 1;
  if (bottom > 0) depth = Math.min(depth, (gradient - bottom) / height);
  if (top < 1) depth = Math.min(depth, (top - gradient) / height);
  if (depth < 0) return;
  const up = soften(depth, shape.softness);
  const [left, right] = sidesAt(shape, gradient);
  const half = Math.max((right - left) / 2, 0.5 / (columns - 1));
  const middle = (left + right) / 2;
  const first = Math.max(0, Math.floor((middle - half) * (columns - 1)));
  const last = Math.min(columns - 1, Math.ceil((middle + half) * (columns - 1)));
  // A rectangle that reaches an end of the window has no soft edge there: intensities beyond it are
  // clipped to the end.
  const isRectangle = shape.kind === "rectangle";
  const isOpenBelow = isRectangle && shape.values[0] === 0;
  const isOpenAbove = isRectangle && shape.values[1] === 1;
  const [red, green, blue] = shape.color;
  for (let k = first; k <= last; k++) {
    const value = k / (columns - 1);
    const isOpen = (isOpenBelow && value <= middle) || (isOpenAbove && value >= middle);
    const across = isOpen ? 1 : soften(1 - Math.abs(value - middle) / half, shape.softness);
    const opacity = shape.opacity * (across * up);
    clear[k] *= 1 - opacity;
    weight[k] += opacity;
    r[k] += opacity * red;
    g[k] += opacity * green;
    b[k] += opacity * blue;
  }
}

function soften(depth: number, softness: number): number {
  if (softness === 0) return depth >= 0 ? 1 : 0;
  return clamp(depth / softness, 0, 1);
}

/** Returns the lowest and highest intensity that a shape covers at one gradient magnitude. */
function sidesAt(shape: Shape, gradient: number): Range {
  const [low, high] = shape.values;
  if (shape.kind === "rectangle") return shape.values;
  const share = gradient / shape.gradients[1];
  return [shape.tip + (low - shape.tip) * share, shape.tip + (high - shape.tip) * share];
}

/**
 * Returns the corners in order around the shape, for drawing. A triangle is cut off below its lower
 * gradient.
 */
export function outline(shape: Shape): readonly HistogramPoint[] {
  const [bottom, top] = shape.gradients;
  const [lowLeft, lowRight] = sidesAt(shape, bottom);
  const [highLeft, highRight] = sidesAt(shape, top);
  const corners = [
    { value: lowLeft, gradient: bottom },
    { value: lowRight, gradient: bottom },
    { value: highRight, gradient: top },
    { value: highLeft, gradient: top },
  ];
  return shape.kind === "triangle" && bottom === 0 ? corners.slice(1) : corners;
}

/**
 * Returns the topmost shape at a point, which is the last one, and the part of it that is hit.
 *
 * @param reach largest distance to a corner or an edge, in each direction of the histogram
 * @param selected index of the shape whose corners and edges are found first
 */
export function hitTest(
  shapes: Shapes,
  point: HistogramPoint,
  reach: HistogramPoint,
  selected: number | null = null,
): Hit | null {
  const order = shapes.map((_, i) => i).reverse();
  if (selected !== null && selected in shapes) order.unshift(selected);
  for (const index of order) {
    const part = partAt(shapes[index], point, reach);
    if (part !== null) return { index, part };
  }
  return null;
}

function partAt(shape: Shape, point: HistogramPoint, reach: HistogramPoint): Part | null {
  const [bottom, top] = shape.gradients;
  const isNear = (value: number, gradient: number) =>
    Math.abs(point.value - value) <= reach.value &&
    Math.abs(point.gradient - gradient) <= reach.gradient;
  const isTriangle = shape.kind === "triangle";
  const [lowLeft, lowRight] = sidesAt(shape, bottom);
  const [highLeft, highRight] = shape.values;
  if (isNear(highLeft, top)) return "top-left";
  if (isNear(highRight, top)) return "top-right";
  if (isTriangle && isNear(shape.tip, 0)) return "tip";
  if (!isTriangle && isNear(lowLeft, bottom)) return "bottom-left";
  if (!isTriangle && isNear(lowRight, bottom)) return "bottom-right";
  if (point.gradient < bottom - reach.gradient || point.gradient > top + reach.gradient)
    return null;
  const [left, right] = sidesAt(shape, clamp(point.gradient, bottom, top));
  if (point.value < left - reach.value || point.value > right + reach.value) return null;
  if (Math.abs(point.gradient - top) <= reach.gradient) return "top";
  // a triangle that reaches down to its tip has no lower edge
  if (!(isTriangle && bottom === 0) && Math.abs(point.gradient - bottom) <= reach.gradient) {
    return "bottom";
  }
  if (!isTriangle && Math.abs(point.value - left) <= reach.value) return "left";
  if (!isTriangle && Math.abs(point.value - right) <= reach.value) return "right";
  return left <= point.value && point.value <= right ? "body" : null;
}

/** Returns the shape moved as a whole, as far as it stays inside the histogram. Its size stays the same. */
export function move(shape: Shape, by: HistogramPoint): Shape {
  const [v0, v1] = shape.values;
  const [g0, g1] = shape.gradients;
  const isTriangle = shape.kind === "triangle";
  const low = isTriangle ? Math.min(v0, shape.tip) : v0;
  const high = isTriangle ? Math.max(v1, shape.tip) : v1;
  const dv = clamp(by.value, -low, 1 - high);
  const dg = clamp(by.gradient, -g0, 1 - g1);
  return {
    ...shape,
    values: shifted(v0, v1, dv),
    gradients: shifted(g0, g1, dg),
    tip: clamp(shape.tip + dv, 0, 1),
  };
}

/** Keeps both ends in 0..1 despite rounding. */
function shifted(low: number, high: number, by: number): Range {
  return [clamp(low + by, 0, 1), clamp(high + by, 0, 1)];
}

/**
 * Returns the shape with one part moved to a point. The shape stays inside the histogram, and does
 * not become smaller than MIN_WIDTH.
 */
export function resize(shape: Shape, part: Part, to: HistogramPoint): Shape {
  if (part === "body") return shape;
  if (part === "tip") return { ...shape, tip: clamp(to.value, 0, 1) };
  let [v0, v1] = shape.values;
  let [g0, g1] = shape.gradients;
  if (part.endsWith("left")) v0 = clamp(to.value, 0, v1 - MIN_WIDTH);
  if (part.endsWith("right")) v1 = clamp(to.value, v0 + MIN_WIDTH, 1);
  if (part.startsWith("bottom")) g0 = clamp(to.gradient, 0, g1 - MIN_HEIGHT);
  if (part.startsWith("top")) g1 = clamp(to.gradient, g0 + MIN_HEIGHT, 1);
  const resized = { ...shape, values: [v0, v1] as const, gradients: [g0, g1] as const };
  return shape.kind === "rectangle" ? { ...resized, tip: (v0 + v1) / 2 } : resized;
}

/**
 * Makes a shape of a standard size at a point: a rectangle around it, or a triangle with its tip
 * below it.
 */
export function makeShape(kind: ShapeKind, at: HistogramPoint): Shape {
  const [width, height] = [0.2, 0.3];
  const tip = clamp(at.value, 0, 1);
  const [v0, g0] = [
    clamp(at.value - width / 2, 0, 1 - width),
    clamp(at.gradient - height / 2, 0, 1 - height),
  ];
  const shape = {
    kind,
    values: [v0, v0 + width] as const,
    gradients: [g0, g0 + height] as const,
    tip,
    color: [1, 1, 1] as const,
    opacity: 0.5,
    softness: 0.5,
  };
  if (kind === "rectangle") return { ...shape, tip: (shape.values[0] + shape.values[1]) / 2 };
  return { ...shape, gradients: [0.5 * shape.gradients[1], shape.gradients[1]] };
}

/** Adds a shape on top; returns the same list if it already has MAX_SHAPES. */
export function addShape(shapes: Shapes, shape: Shape): Shapes {
  return shapes.length < MAX_SHAPES ? [...shapes, shape] : shapes;
}

export function removeShape(shapes: Shapes, index: number): Shapes {
  return shapes.filter((_, i) => i !== index);
}

export function replaceShape(shapes: Shapes, index: number, shape: Shape): Shapes {
  return shapes.map((old, i) => (i === index ? shape : old));
}
