/**
 * The geometry of the three slices: planes at right angles through one point, the directions that lead right and up in
 * their images, and the letters at the edges. A patient is shown by the convention of radiologists, from the front or
 * from the feet. The patient's right is on the left of the image, and the nose is on the left of a sagittal image, as
 * in the images of `stereocell slices`. All lengths are in um. Pure.
 */
import { Euler, Quaternion, Vector3 } from "three";
import type { Box } from "../math/box";
import { planeSection } from "../math/plane_box_section";
import { AXES, dot, type Ray, type Vec3 } from "../math/vec3";

/** Directions to the sides of the patient, as unit vectors; null: there is no patient, or the sides are not known. */
export type PatientSides = Readonly<{ left: Vec3; posterior: Vec3; superior: Vec3 }> | null;

export type SliceFrame = Readonly<{
  name: string;
  /** The point of the plane at the centre of the image. */
  origin: Vec3;
  /** Unit vectors that lead right and up in the image, and from the plane to the eye (`normal`). */
  right: Vec3;
  up: Vec3;
  normal: Vec3;
  /** Half the image's edges, um. The image is large enough for the whole box, wherever the plane lies. */
  half: readonly [number, number];
  /** Letters at the left, right, upper and lower edge. */
  ends: readonly [string, string, string, string];
}>;

export type SlicePlace = Readonly<{
  /** The point where the planes meet. */
  point: Vec3;
  /** Rotation by Euler angles about x, y and z, in three's order XYZ. */
  turn_deg: Vec3;
}>;

const RADIANS = Math.PI / 180;
/** Cosine of the largest angle, 20 degrees, between an edge's direction and a side at which only that side is named. */
const ALONG = Math.cos(20 * RADIANS);

/** Returns the point at the given shares of a box along x, y, z, 0..1. */
export function pointAt(shares: Vec3, { min, max }: Box): Vec3 {
  const at = (i: 0 | 1 | 2) => min[i] + shares[i] * (max[i] - min[i]);
  return [at(0), at(1), at(2)];
}

/** Returns the shares of a box at which a point lies, limited to 0..1. */
export function sharesOf(point: Vec3, { min, max }: Box): Vec3 {
  const at = (i: 0 | 1 | 2) => {
    const edge = max[i] - min[i];
    return edge > 0 ? Math.min(1, Math.max(0, (point[i] - min[i]) / edge)) : 0.5;
  };
  return [at(0), at(1), at(2)];
}

export const negated = ([x, y, z]: Vec3): Vec3 => [-x, -y, -z];

/** Name, right and up of each plane before the rotation. */
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
 * Returns the text at an edge of an image: the letter of the patient's side in that direction, or an axis with its sign.
 * An oblique direction has the letters of all sides that it leads to, the nearest first.
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

/** A position in an image, 0..1 from its left and its top. */
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

/** Returns the polygon of a plane within a box, in order around the normal. It has no corners if the plane misses. */
export function outlineOf({ origin, normal }: SliceFrame, box: Box): readonly Vec3[] {
  return planeSection({ normal, offset_um: dot(normal, origin) }, box);
}

/** Returns the Euler angles, in degrees, of a rotation followed by another one about a unit vector. */
export function turnedBy(turn_deg: Vec3, about: Vec3, by_deg: number): Vec3 {
  const [x, y, z] = turn_deg.map((angle) => angle * RADIANS);
  const turn = new Quaternion().setFromEuler(new Euler(x, y, z));
  turn.premultiply(new Quaternion().setFromAxisAngle(new Vector3(...about), by_deg * RADIANS));
  const euler = new Euler().setFromQuaternion(turn);
  return [euler.x / RADIANS, euler.y / RADIANS, euler.z / RADIANS];
}

/** Returns the nearest point, within the box, where a ray hits a plane, and its distance in lengths of the direction. */
export function hitSlices(
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
