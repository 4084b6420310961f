/** Clipping the specimen with a box and a free plane, and the handles that drag them. um, world. */
import { Vector3 } from "three";
import { type Box, boxSpan, centerOf, type Span } from "./box";
import { AXES, along, dot, type Ray, type Vec3, withPart } from "./vec3";

/**
 * A clip plane keeps the points with normal · p <= offset_um. The normal has unit length and points
 * to the removed side.
 */
export type ClipPlane = Readonly<{ normal: Vec3; offset_um: number }>;
/**
 * The cuts, um, world. The points inside `box` and behind `plane` are kept; null means that this
 * cut is off. Points beyond all planes of `corner` are removed, too.
 */
export type Clip = Readonly<{
  box: Box | null;
  plane: ClipPlane | null;
  corner?: readonly ClipPlane[];
}>;
/** Nothing is clipped. */
export const WHOLE: Clip = { box: null, plane: null };

export type Side = "min" | "max";
/** Handle of one face of the box; `direction` points out of the box. */
export type BoxHandle = Readonly<{
  axis: (typeof AXES)[number];
  side: Side;
  position: Vec3;
  direction: Vec3;
}>;
/** `middle` moves the plane along its normal; `tip` turns it about the middle. */
export type PlaneHandles = Readonly<{ middle: Vec3; tip: Vec3 }>;

/** Least thickness of the box, as a share of the specimen's edge. */
const THINNEST = 0.01;
/**
 * Least squared sine of the angle between a ray and a handle's axis; a ray closer to parallel does
 * not move the handle.
 */
const PARALLEL = 1e-6;

/** The part of a ray's span inside box and plane, or null. */
export function clipSpan(span: Span, ray: Ray, { box, plane, corner }: Clip): Span | null {
  const inBox = box === null ? span : boxSpan(span, ray, box);
  if (inBox === null) return null;
  let [from, to] = inBox;
  if (plane !== null) {
    // Depth inside the plane at which the ray begins.
    const depth = plane.offset_um - dot(plane.normal, ray.origin);
    const rate = dot(plane.normal, ray.direction);
    if (rate > 0) to = Math.min(to, depth / rate);
    else if (rate < 0) from = Math.max(from, depth / rate);
    else if (depth < 0) return null;
  }
  if (corner !== undefined) from = cornerExit(from, ray, corner);
  return from < to ? [from, to] : null;
}

/** Where a ray that begins in a removed corner leaves it; at least `from`. */
function cornerExit(from: number, ray: Ray, corner: readonly ClipPlane[]): number {
  const exits = corner.map(({ normal, offset_um }) => {
    const depth = offset_um - dot(normal, ray.origin);
    const rate = dot(normal, ray.direction);
    if (rate < 0) return depth / rate;
    return depth < 0 ? Number.POSITIVE_INFINITY : 0;
  });
  return Math.max(from, Math.min(...exits));
}

export function isKept(point: Vec3, { box, plane, corner }: Clip): boolean {
  const isInBox =
    box === null || AXES.every((i) => point[i] >= box.min[i] && point[i] <= box.max[i]);
  const isBeyond = ({ normal, offset_um }: ClipPlane) => dot(normal, point) > offset_um;
  return isInBox && !(plane !== null && isBeyond(plane)) && !corner?.every(isBeyond);
}

/**
 * Moves the points beyond a plane straight onto it. The kept part of a body lies within the result.
 */
export function behindPlane(points: readonly Vec3[], plane: ClipPlane): readonly Vec3[] {
  return points.map((point) => {
    const beyond = dot(plane.normal, point) - plane.offset_um;
    return beyond > 0 ? along(point, plane.normal, -beyond) : point;
  });
}

/**
 * Moves points that the clip removes, or that lie outside the box `within`, to the nearest kept
 * point.
 */
export function keptPoints(
  points: readonly Vec3[],
  { box, plane }: Clip,
  within: Box,
): readonly Vec3[] {
  const boxes = box === null ? [within] : [within, box];
  const inside = points.map((point) =>
    boxes.reduce(
      (at, { min, max }): Vec3 => [
        Math.min(Math.max(at[0], min[0]), max[0]),
        Math.min(Math.max(at[1], min[1]), max[1]),
        Math.min(Math.max(at[2], min[2]), max[2]),
      ],
      point,
    ),
  );
  return plane === null ? inside : behindPlane(inside, plane);
}

/** Whether nothing is left of a box. */
export function isCutAway(of: Box, { box, plane }: Clip): boolean {
  const min = AXES.map((i) => (box === null ? of.min[i] : Math.max(of.min[i], box.min[i])));
  const max = AXES.map((i) => (box === null ? of.max[i] : Math.min(of.max[i], box.max[i])));
  const isGone = AXES.some((i) => (of.min[i] < of.max[i] ? min[i] >= max[i] : min[i] > max[i]));
  if (isGone || plane === null) return isGone;
  const { normal, offset_um } = plane;
  const deepest = AXES.reduce<number>(
    (sum, i) => sum + normal[i] * (normal[i] > 0 ? min[i] : max[i]),
    0,
  );
  return deepest >= offset_um;
}

export function boxHandles(box: Box): readonly BoxHandle[] {
  const middle = centerOf(box);
  return AXES.flatMap((axis) =>
    (["min", "max"] as const).map((side) => ({
      axis,
      side,
      position: withPart(middle, axis, box[side][axis]),
      direction: withPart([0, 0, 0], axis, side === "max" ? 1 : -1),
    })),
  );
}

/** Drags a face of the box to where the ray is closest to the handle's axis. */
export function dragBox(
  box: Box,
  handle: Pick<BoxHandle, "axis" | "side">,
  ray: Ray,
  specimen: Box,
): Box {
  const { axis, side } = handle;
  const face = withPart(centerOf(box), axis, box[side][axis]);
  const along = closestOnLine(face, withPart([0, 0, 0], axis, 1), ray);
  return along === null ? box : moveFace(box, handle, along, specimen);
}

/** Moves a face along its axis; the box stays in the specimen and keeps its least thickness. */
export function moveFace(
  box: Box,
  { axis, side }: Pick<BoxHandle, "axis" | "side">,
  by_um: number,
  specimen: Box,
): Box {
  const gap = THINNEST * (specimen.max[axis] - specimen.min[axis]);
  const lowest = side === "min" ? specimen.min[axis] : box.min[axis] + gap;
  const highest = side === "max" ? specimen.max[axis] : box.max[axis] - gap;
  const wanted = Math.min(Math.max(box[side][axis] + by_um, lowest), highest);
  return { ...box, [side]: withPart(box[side], axis, wanted) };
}

/**
 * The handles of the plane: `middle` on it, nearest to the specimen's centre, and `tip` at a
 * distance along its normal.
 */
export function planeHandles(plane: ClipPlane, specimen: Box, arm_um: number): PlaneHandles {
  const center = centerOf(specimen);
  const middle = along(center, plane.normal, plane.offset_um - dot(plane.normal, center));
  return { middle, tip: along(middle, plane.normal, arm_um) };
}

/** Drags the plane's middle along its normal. */
export function slidePlane(plane: ClipPlane, ray: Ray, specimen: Box): ClipPlane {
  const { middle } = planeHandles(plane, specimen, 0);
  const by = closestOnLine(middle, plane.normal, ray);
  return by === null ? plane : movePlane(plane, by, specimen);
}

/** Moves the plane along its normal; it stays in the specimen. */
export function movePlane(plane: ClipPlane, by_um: number, specimen: Box): ClipPlane {
  const moved = withinSpecimen(plane.normal, plane.offset_um + by_um, specimen);
  return moved.offset_um === plane.offset_um ? plane : moved;
}

/**
 * Drags the plane's tip, which turns the plane about its middle. The tip goes to the intersection
 * of the ray and the sphere around the middle that is nearer to the tip. If the ray misses the
 * sphere, the tip goes to the place nearest to the ray.
 */
export function turnPlane(plane: ClipPlane, ray: Ray, specimen: Box, arm_um: number): ClipPlane {
  const { middle, tip } = planeHandles(plane, specimen, arm_um);
  const center = new Vector3(...middle);
  const origin = new Vector3(...ray.origin);
  const direction = new Vector3(...ray.direction).normalize();
  const nearest = Math.max(0, center.clone().sub(origin).dot(direction));
  const foot = origin.clone().addScaledVector(direction, nearest);
  const half = Math.sqrt(Math.max(0, arm_um ** 2 - foot.distanceToSquared(center)));
  const ends = [-half, half]
    .map((by) => nearest + by)
    .filter((t) => t >= 0)
    .map((t) => origin.clone().addScaledVector(direction, t));
  const handle = new Vector3(...tip);
  ends.sort((a, b) => a.distanceToSquared(handle) - b.distanceToSquared(handle));
  const normal = (ends[0] ?? foot).sub(center);
  // The ray passes through the middle itself, so there is no direction.
  if (!(normal.length() > 0)) return plane;
  return aboutMiddle(plane, normal.normalize().toArray(), specimen);
}

/** Turns the plane about an axis through its middle, counterclockwise. */
export function spinPlane(
  plane: ClipPlane,
  axis: (typeof AXES)[number],
  angle_rad: number,
  specimen: Box,
): ClipPlane {
  const normal = new Vector3(...plane.normal);
  normal.applyAxisAngle(new Vector3(...withPart([0, 0, 0], axis, 1)), angle_rad);
  return aboutMiddle(plane, normal.normalize().toArray(), specimen);
}

/**
 * Returns the clip plane that has another normal, and passes through the middle point of its
 * handles as before.
 */
function aboutMiddle(plane: ClipPlane, normal: Vec3, specimen: Box): ClipPlane {
  const { middle } = planeHandles(plane, specimen, 0);
  return withinSpecimen(normal, dot(normal, middle), specimen);
}

/** The plane with its offset limited to the range of the specimen's corners. */
export function withinSpecimen(normal: Vec3, offset_um: number, specimen: Box): ClipPlane {
  const center = dot(normal, centerOf(specimen));
  const reach = AXES.reduce<number>(
    (sum, i) => sum + (Math.abs(normal[i]) * (specimen.max[i] - specimen.min[i])) / 2,
    0,
  );
  return { normal, offset_um: Math.min(Math.max(offset_um, center - reach), center + reach) };
}

/**
 * Returns how far along a line (unit direction, from `point`) the ray comes closest to it, or null
 * if both are parallel. Places behind the ray's origin do not count.
 */
export function closestOnLine(point: Vec3, direction: Vec3, ray: Ray): number | null {
  const line = new Vector3(...direction);
  const toward = new Vector3(...ray.direction).normalize();
  const gap = new Vector3(...ray.origin).sub(new Vector3(...point));
  const cosine = line.dot(toward);
  const sine2 = 1 - cosine ** 2;
  if (!(sine2 > PARALLEL)) return null;
  const onRay = (cosine * line.dot(gap) - toward.dot(gap)) / sine2;
  return line.dot(gap) + Math.max(0, onRay) * cosine;
}
