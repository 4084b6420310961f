/**
 * Turns the axes of a patient's volume to canonical ones: anterior, inferior, left. Voxels are flipped and permuted,
 * never resampled. The remaining small rotation is part of the placement.
 *
 * Follows pipeline/stereocell/read/anatomical_axes.py. Points are in LPS (left, posterior, superior), mm. In the world +x
 * is the patient's left, +y superior and +z anterior.
 */
import { type StoredVoxels, type Triple, triple } from "./coarse_volume";

/** Columns of a 3 x 4 matrix, LPS in mm: a step along each stored axis, and the centre of the first voxel. */
export type Affine = Readonly<{ axes: readonly [Triple, Triple, Triple]; origin: Triple }>;

export type Canonical = Readonly<{
  /** The stored axes that become z, y and x. */
  order: readonly [0 | 1 | 2, 0 | 1 | 2, 0 | 1 | 2];
  /** Whether z, y, x run backwards along the stored axis. */
  flips: readonly [boolean, boolean, boolean];
  /** Distance between voxels along z, y and x, um. */
  spacing_um: Triple;
  /** 4 x 4, column-major, um: from the world of the voxels, whose origin is the first one, to the patient's. */
  placement: readonly number[];
}>;

export const IDENTITY: readonly number[] = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];

export const UM_PER_MM = 1000;
/** Anterior, inferior and left, in LPS. */
const CANONICAL: readonly Triple[] = [
  [0, -1, 0],
  [0, 0, -1],
  [1, 0, 0],
];
const ORDERS: readonly Canonical["order"][] = [
  [0, 1, 2],
  [0, 2, 1],
  [1, 0, 2],
  [1, 2, 0],
  [2, 0, 1],
  [2, 1, 0],
];

const dot = (a: Triple, b: Triple) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const lengthOf = (a: Triple) => Math.sqrt(dot(a, a));
const times = (a: Triple, by: number): Triple => [a[0] * by, a[1] * by, a[2] * by];
const plus = (a: Triple, b: Triple): Triple => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
/** From LPS to the world's axes. */
const toWorld = ([l, p, s]: Triple): Triple => [l, s, -p];

/** @param shape voxels along the stored axes */
export function canonicalOf({ axes, origin }: Affine, shape: Triple): Canonical {
  const units = axes.map((axis) => times(axis, 1 / lengthOf(axis)));
  const likeness = (order: Canonical["order"]) =>
    order.reduce<number>((sum, axis, i) => sum + Math.abs(dot(CANONICAL[i], units[axis])), 0);
  const order = ORDERS.reduce((best, one) => (likeness(one) > likeness(best) ? one : best));
  const flips = order.map((axis, i) => dot(CANONICAL[i], units[axis]) < 0);
  const first = order.reduce<Triple>(
    (sum, axis, i) => (flips[i] ? plus(sum, times(axes[axis], shape[axis] - 1)) : sum),
    origin,
  );
  const [z, y, x] = order.map((axis, i) => toWorld(times(units[axis], flips[i] ? -1 : 1)));
  const spacing = order.map((axis) => lengthOf(axes[axis]) * UM_PER_MM);
  const at = times(toWorld(first), UM_PER_MM);
  const placement = [...x, 0, ...times(y, -1), 0, ...z, 0, ...at, 1]; // y is negated, because image rows run downwards
  return {
    order,
    flips: [flips[0], flips[1], flips[2]],
    spacing_um: [spacing[0], spacing[1], spacing[2]],
    placement: placement.map((value) => value + 0), // turns -0 into 0
  };
}

/** Returns the same stored voxels with the order and strides of canonical axes; no data is copied. */
export function turned(
  voxels: StoredVoxels,
  { order, flips }: Pick<Canonical, "order" | "flips">,
): StoredVoxels {
  const shape = triple((i) => voxels.shape[order[i]]);
  const strides = triple((i) => voxels.strides[order[i]]);
  const ends = triple((i) => (flips[i] ? (shape[i] - 1) * strides[i] : 0));
  return {
    ...{ ...voxels, shape },
    strides: triple((i) => (flips[i] ? -strides[i] : strides[i])),
    offset: voxels.offset + ends[0] + ends[1] + ends[2],
  };
}
