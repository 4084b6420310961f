/**
 * From where a specimen is seen at first: three quarters from the front, a little from above, so near
 * that it fills the picture. Of such views one is taken in which it covers much: a long specimen lies
 * across a wide picture, and goes into the depth of a narrow one. Pure.
 */
import type { Box } from "../math/box";
import type { Vec3 } from "../math/vec3";

/** Share of the picture that the specimen may fill. */
const FILL = 0.94;
const DEGREE = Math.PI / 180;
/** Of the eye: to the right of straight ahead, and above. The first of each is what one expects. */
const ASIDE_DEG = [35, 30, 40, 25, 45, 50, 55, 60, 65, 70];
const ABOVE_DEG = [25, 30, 20, 35, 40, 45, 50, 55];
/** Share of the best view's coverage with which an earlier one of the lists will do. */
const GOOD_ENOUGH = 0.88;

/** Where the eye is, about the middle of what it looks at. */
export type Direction = Readonly<{ aside_rad: number; above_rad: number }>;

export type Lens = Readonly<{
  /** Vertical field of view. */
  fov_rad: number;
  /** Width of the picture to its height. */
  aspect: number;
}>;

/** The eye's axes: right, up, and towards it. */
function axesOf({ aside_rad, above_rad }: Direction): readonly [Vec3, Vec3, Vec3] {
  const [s, c] = [Math.sin(aside_rad), Math.cos(aside_rad)];
  const [u, v] = [Math.sin(above_rad), Math.cos(above_rad)];
  return [
    [c, 0, -s],
    [-s * u, v, -c * u],
    [s * v, u, c * v],
  ];
}

/** Unit vector from the middle to the eye. */
export function towardsEye(direction: Direction): Vec3 {
  return axesOf(direction)[2];
}

/** Distance of the eye from a box's middle at which the whole box is in the picture. */
export function distanceToFrame({ min, max }: Box, direction: Direction, lens: Lens): number {
  const half = FILL * Math.tan(lens.fov_rad / 2);
  const axes = axesOf(direction);
  const edges = max.map((v, i) => (v - min[i]) / 2);
  let needed = 0;
  for (let corner = 0; corner < 8; corner++) {
    const at = edges.map((edge, i) => ((corner >> i) & 1 ? edge : -edge));
    const [x, y, z] = axes.map((axis) => axis.reduce((sum, v, i) => sum + v * at[i], 0));
    needed = Math.max(needed, z + Math.max(Math.abs(y), Math.abs(x) / lens.aspect) / half);
  }
  return needed;
}

/** Rounds in which middle and distance find each other. */
const ROUNDS = 5;

/**
 * Where the eye looks, and from how far, so that a box is seen as large as fits and in the middle: its own
 * middle is not there, since what is nearer is larger.
 *
 * @param up_tan how far above the picture's middle the box's is to be, a metre away
 */
export function frameBox(
  { min, max }: Box,
  direction: Direction,
  lens: Lens,
  up_tan = 0,
): Readonly<{ target: Vec3; distance: number }> {
  const half = FILL * Math.tan(lens.fov_rad / 2);
  const axes = axesOf(direction);
  const middle = max.map((v, i) => (v + min[i]) / 2);
  const edges = max.map((v, i) => (v - min[i]) / 2);
  const corners = Array.from({ length: 8 }, (_, corner) => {
    const at = edges.map((edge, i) => ((corner >> i) & 1 ? edge : -edge));
    return axes.map((axis) => axis.reduce((sum, v, i) => sum + v * at[i], 0));
  });
  let [right, up, distance] = [0, 0, 0];
  for (let round = 0; round < ROUNDS; round++) {
    const needs = corners.map(([x, y, z]) => {
      return z + Math.max(Math.abs(y - up), Math.abs(x - right) / lens.aspect) / half;
    });
    distance = Math.max(...needs);
    const across = corners.map(([x, , z]) => (x - right) / (distance - z));
    const along = corners.map(([, y, z]) => (y - up) / (distance - z));
    right += ((Math.max(...across) + Math.min(...across)) / 2) * distance;
    up += ((Math.max(...along) + Math.min(...along)) / 2) * distance;
  }
  const lift = up - up_tan * distance;
  const at = (i: 0 | 1 | 2) => middle[i] + axes[0][i] * right + axes[1][i] * lift;
  return { target: [at(0), at(1), at(2)], distance };
}

/** About the share of the picture that the box covers. */
function coverage(box: Box, direction: Direction, lens: Lens): number {
  const [x, y, z] = box.max.map((v, i) => v - box.min[i]);
  const [dx, dy, dz] = towardsEye(direction).map(Math.abs);
  const silhouette = dx * y * z + dy * x * z + dz * x * y;
  return silhouette / distanceToFrame(box, direction, lens) ** 2;
}

export function openingView(box: Box, lens: Lens): Direction {
  const views = ASIDE_DEG.flatMap((aside) =>
    ABOVE_DEG.map((above) => ({ aside_rad: aside * DEGREE, above_rad: above * DEGREE })),
  );
  const covered = views.map((view) => coverage(box, view, lens));
  const enough = GOOD_ENOUGH * Math.max(...covered);
  return views[covered.findIndex((share) => share >= enough)];
}
