/** Placement of the specimen and the eye. Lengths in the scene are metres. */
import type { Manifest } from "../bundle/generated/bundle";

type Bounds = Manifest["specimen"]["bounds_um"];
type Vec3 = readonly [number, number, number];

/** Metres. The specimen's longest edge in the scene. */
export const LONGEST_EDGE_M = 1.2;
/** Metres. Distance from the eyes to the specimen's centre in a headset, at the eyes' height. */
export const XR_DISTANCE_M = 1.1;
/**
 * Metres, in the user's own room: distance ahead of the eyes; heights of the specimen's middle
 * above the floor and below the eyes.
 */
export const ROOM_DISTANCE_M = 0.9;
export const OVER_FLOOR_M = 0.95;
export const UNDER_EYES_M = 0.5;
/**
 * Size in the user's own room as a factor of the size in a headset: it stands on a table, not
 * around the user.
 */
export const ROOM_SIZE = 0.4;

/** Share of the image that the specimen may fill at the start. */
const FILL = 0.88;
/**
 * Least distance of the eye, as a multiple of the points' distance from the point about which the
 * camera turns.
 */
const BEFORE = 1.25;

export type Placement = Readonly<{
  /** Metres of the scene per um of the specimen. */
  scale: number;
  /** The specimen's centre, um, world. */
  center: Vec3;
  /** The specimen's edges in the scene, metres. */
  size: Vec3;
}>;

export function place(bounds: Bounds): Placement {
  const edge = (i: number) => bounds.max[i] - bounds.min[i];
  const longest = Math.max(edge(0), edge(1), edge(2));
  const scale = LONGEST_EDGE_M / (longest > 0 ? longest : 1);
  const middle = (i: number) => (bounds.min[i] + bounds.max[i]) / 2;
  return {
    scale,
    center: [middle(0), middle(1), middle(2)],
    size: [edge(0) * scale, edge(1) * scale, edge(2) * scale],
  };
}

/**
 * Distance from the specimen's centre to a camera in front of it (towards +z) that sees its whole
 * front face.
 *
 * @param fov_rad vertical field of view
 */
export function framingDistance(size: Vec3, fov_rad: number, aspect: number): number {
  const half = Math.tan(fov_rad / 2);
  return size[2] / 2 + Math.max(size[1], size[0] / aspect) / (2 * FILL * half);
}

/**
 * Distance from the point that is looked at to an eye that also sees other points. The eye stays
 * farther than each point by a margin.
 *
 * @param points relative to the point that is looked at, in the eye's axes: x right, y up, z
 *   towards the eye
 * @param fov_rad vertical field of view
 */
export function distanceToSee(points: readonly Vec3[], fov_rad: number, aspect: number): number {
  const half = FILL * Math.tan(fov_rad / 2);
  const needed = points.map(([x, y, z]) =>
    Math.max(z + Math.max(Math.abs(y), Math.abs(x) / aspect) / half, BEFORE * Math.hypot(x, y, z)),
  );
  return Math.max(0, ...needed);
}
