/**
 * Three planes through one point, at right angles, and how each is looked at: which way is right, which
 * is up, what stands at the edges. A patient is shown as radiologists do, from the front and from the
 * feet, so that the patient's right is on the picture's left, and the nose to the left of a sagittal
 * picture (as `stereocell slices` has it). um, world. Pure.
 */
import { Euler, Quaternion, Vector3 } from "three";
import type { Box } from "../math/box";
import { planeSection } from "../math/plane_box_section";
import { AXES, dot, type Ray, type Vec3 } from "../math/vec3";

/** Of the patient, as unit vectors; null: there is none, or nobody knows. */
export type PatientSides = Readonly<{ left: Vec3; posterior: Vec3; superior: Vec3 }> | null;

export type SliceFrame = Readonly<{
  name: string;
  /** The point of the plane in the picture's middle. */
  origin: Vec3;
  /** Unit vectors; the eye looks against the normal. */
  right: Vec3;
  up: Vec3;
  normal: Vec3;
  /** Half the picture's edges, um: they hold all of the box, wherever the plane is. */
  half: readonly [number, number];
  /** What stands at the left, right, upper and lower edge. */
  ends: readonly [string, string, string, string];
}>;

export type SlicePlace = Readonly<{
  /** Where the planes meet. */
  point: Vec3;
  /** About x, then y, then z. */
  turn_deg: Vec3;
}>;

const RADIANS = Math.PI / 180;
/** A plane turned by less shows the sides of the patient that it showed before, degrees. */
const ALONG = Math.cos(20 * RADIANS);

/** The point at shares of a box along x, y, z. */
export function pointAt(shares: Vec3, { min, max }: Box): Vec3 {
  const at = (i: 0 | 1 | 2) => min[i] + shares[i] * (max[i] - min[i]);
  return [at(0), at(1), at(2)];
}

/** Its shares of a box, within it. */
export function sharesOf(point: Vec3, { min, max }: Box): Vec3 {
  const at = (i: 0 | 1 | 2) => {
    const edge = max[i] - min[i];
    return edge > 0 ? Math.min(1, Math.max(0, (point[i] - min[i]) / edge)) : 0.5;
  };
  return [at(0), at(1), at(2)];
}

/** The other way. */
export const negated = ([x, y, z]: Vec3): Vec3 => [-x, -y, -z];

/** Name, right and up of each plane before it is turned. */
function straight(sides: PatientSides): readonly (readonly [string, Vec3, Vec3])[] {
  if (sides === null) {
    return [
      ["xy", [1, 0, 0], [0, 1, 0]],
      ["xz", [1, 0, 0], [0, 0, -1]],
      ["yz", [0, 0, 1], [0, 1, 0]],
    ];
  }
  const { left, posterior, superior } = sides;
  return [
    ["axial", left, negated(posterior)],
    ["coronal", left, superior],
    ["sagittal", posterior, superior],
  ];
}

export function sliceFrames(
  { point, turn_deg }: SlicePlace,
  box: Box,
  sides: PatientSides,
): readonly [SliceFrame, SliceFrame, SliceFrame] {
  const [x, y, z] = turn_deg.map((angle) => angle * RADIANS);
  const turn = new Quaternion().setFromEuler(new Euler(x, y, z));
  const middle = new Vector3(...box.min).add(new Vector3(...box.max)).multiplyScalar(0.5);
  const corners = Array.from(
    { length: 8 },
    (_, i) => new Vector3(...AXES.map((axis) => ((i >> axis) & 1 ? box.max : box.min)[axis])),
  );
  const [a, b, c] = straight(sides).map(([name, toRight, toTop]): SliceFrame => {
    const right = new Vector3(...toRight).applyQuaternion(turn).normalize();
    const up = new Vector3(...toTop).applyQuaternion(turn);
    up.addScaledVector(right, -up.dot(right)).normalize();
    const normal = right.clone().cross(up);
    const off = new Vector3(...point).sub(middle).dot(normal);
    const halfAlong = (axis: Vector3) =>
      Math.max(...corners.map((corner) => Math.abs(corner.clone().sub(middle).dot(axis))));
    return {
      name,
      origin: middle.clone().addScaledVector(normal, off).toArray(),
      right: right.toArray(),
      up: up.toArray(),
      normal: normal.toArray(),
      half: [halfAlong(right), halfAlong(up)],
      ends: [
        endOf(right.clone().negate(), sides),
        endOf(right, sides),
        endOf(up, sides),
        endOf(up.clone().negate(), sides),
      ],
    };
  });
  return [a, b, c];
}

/**
 * What lies there: of a patient the letter of the nearest side, of an oblique direction those of all that
 * it leads to, the nearest first; else an axis, with its sign.
 */
function endOf(direction: Vector3, sides: PatientSides): string {
  const named: readonly (readonly [string, Vec3])[] =
    sides === null
      ? [
          ["+x", [1, 0, 0]],
          ["−x", [-1, 0, 0]],
          ["+y", [0, 1, 0]],
          ["−y", [0, -1, 0]],
          ["+z", [0, 0, 1]],
          ["−z", [0, 0, -1]],
        ]
      : [
          ["L", sides.left],
          ["R", negated(sides.left)],
          ["P", sides.posterior],
          ["A", negated(sides.posterior)],
          ["S", sides.superior],
          ["I", negated(sides.superior)],
        ];
  const toward = direction.toArray();
  const found = named
    .map(([name, along]) => [name, dot(along, toward)] as const)
    .sort((p, q) => q[1] - p[1]);
  if (found[0][1] >= ALONG) return found[0][0];
  return found
    .filter(([, cosine]) => cosine > Math.sin(20 * RADIANS))
    .map(([name]) => name)
    .join(sides === null ? " " : "");
}

/** A place of a picture, 0..1 from its left and its top. */
export type PicturePlace = Readonly<{ x: number; y: number }>;

export function pointIn({ origin, right, up, half }: SliceFrame, { x, y }: PicturePlace): Vec3 {
  const [across, along] = [(2 * x - 1) * half[0], (1 - 2 * y) * half[1]];
  const at = (i: 0 | 1 | 2) => origin[i] + across * right[i] + along * up[i];
  return [at(0), at(1), at(2)];
}

export function placeIn({ origin, right, up, half }: SliceFrame, point: Vec3): PicturePlace {
  const from: Vec3 = [point[0] - origin[0], point[1] - origin[1], point[2] - origin[2]];
  return { x: (dot(from, right) / half[0] + 1) / 2, y: (1 - dot(from, up) / half[1]) / 2 };
}

/** The plane's polygon within a box, in order round its normal; fewer than three corners: it misses it. */
export function outlineOf({ origin, normal }: SliceFrame, box: Box): readonly Vec3[] {
  return planeSection({ normal, offset_um: dot(normal, origin) }, box);
}

/** The planes turned further, about a unit vector: as turns about x, y, z. */
export function turnedBy(turn_deg: Vec3, about: Vec3, by_deg: number): Vec3 {
  const [x, y, z] = turn_deg.map((angle) => angle * RADIANS);
  const turn = new Quaternion().setFromEuler(new Euler(x, y, z));
  turn.premultiply(new Quaternion().setFromAxisAngle(new Vector3(...about), by_deg * RADIANS));
  const euler = new Euler().setFromQuaternion(turn);
  return [euler.x / RADIANS, euler.y / RADIANS, euler.z / RADIANS];
}

/** Where a ray meets the nearest of the planes within the box, and how far away, in its direction's lengths. */
export function meetSlices(
  { origin, direction }: Ray,
  frames: readonly SliceFrame[],
  { min, max }: Box,
): Readonly<{ point: Vec3; distance: number }> | null {
  let nearest: { point: Vec3; distance: number } | null = null;
  for (const frame of frames) {
    const rate = dot(frame.normal, direction);
    if (Math.abs(rate) < 1e-9) continue;
    const distance = (dot(frame.normal, frame.origin) - dot(frame.normal, origin)) / rate;
    if (!(distance > 0) || (nearest !== null && distance >= nearest.distance)) continue;
    const at = (i: 0 | 1 | 2) => origin[i] + distance * direction[i];
    const point: Vec3 = [at(0), at(1), at(2)];
    if (AXES.every((i) => point[i] >= min[i] && point[i] <= max[i])) nearest = { point, distance };
  }
  return nearest;
}
