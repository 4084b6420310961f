/**
 * Chooses the opening view of a specimen: three-quarter from the front, a little from above, as
 * near as fits. Among these views it takes one in which the specimen covers much of the image. A
 * long specimen lies across a wide image, and goes into the depth of a narrow one.
 */
import { around, type Box, centerOf, cornersOf } from "../math/box";
import { along, dot, type Vec3 } from "../math/vec3";

/** Share of the image's width and height that the specimen may fill. */
const FILL = 0.94;
const DEGREE = Math.PI / 180;
/**
 * Degrees to the right of straight ahead, and above it, in order of preference: users expect the
 * first of each.
 */
const ASIDE_DEG = [35, 30, 40, 25, 45, 50, 55, 60, 65, 70];
const ABOVE_DEG = [25, 30, 20, 35, 40, 45, 50, 55];
/** Share of the best view's coverage at which an earlier view in the lists is preferred. */
const GOOD_ENOUGH = 0.88;

/** Direction from the middle of the view to the eye. */
export type Direction = Readonly<{ aside_rad: number; above_rad: number }>;

export type Lens = Readonly<{
  fov_rad: number;
  aspect: number;
}>;

/** The eye's axes: right, up, and backwards, from the middle to the eye. */
function axesOf({ aside_rad, above_rad }: Direction): readonly [Vec3, Vec3, Vec3] {
  const [s, c] = [Math.sin(aside_rad), Math.cos(aside_rad)];
  const [u, v] = [Math.sin(above_rad), Math.cos(above_rad)];
  return [
    [c, 0, -s],
    [-s * u, v, -c * u],
    [s * v, u, c * v],
  ];
}

export function towardsEye(direction: Direction): Vec3 {
  return axesOf(direction)[2];
}

/** Points relative to a middle, along the eye's axes. */
function seenFrom(points: readonly Vec3[], middle: Vec3, direction: Direction): readonly Vec3[] {
  const [right, up, back] = axesOf(direction);
  return points.map((point) => {
    const at = along(point, middle, -1);
    return [dot(right, at), dot(up, at), dot(back, at)];
  });
}

/**
 * Distance of an eye at which all points are in the image. The eye looks `right` of the middle and
 * `up` above it.
 */
function distanceTo(seen: readonly Vec3[], { fov_rad, aspect }: Lens, right = 0, up = 0): number {
  const half = FILL * Math.tan(fov_rad / 2);
  const needed = seen.map(
    ([x, y, z]) => z + Math.max(Math.abs(y - up), Math.abs(x - right) / aspect) / half,
  );
  return Math.max(...needed);
}

/** Distance from the middle of the points at which an eye sees all of them. */
export function distanceToFrame(points: readonly Vec3[], direction: Direction, lens: Lens): number {
  return distanceTo(seenFrom(points, centerOf(around(points)), direction), lens);
}

/** Iterations in which the view's middle and its distance converge. */
const ROUNDS = 5;

/**
 * Returns the point that the eye looks at and its distance, so that the points are centred and as
 * large as fits. That point is not the middle of the points, because nearer ones look larger.
 *
 * @param up_tan tangent of the angle by which the points' middle lies above the image's middle
 */
export function framePoints(
  points: readonly Vec3[],
  direction: Direction,
  lens: Lens,
  up_tan = 0,
): Readonly<{ target: Vec3; distance: number }> {
  const axes = axesOf(direction);
  const middle = centerOf(around(points));
  const seen = seenFrom(points, middle, direction);
  let [right, up, distance] = [0, 0, 0];
  for (let round = 0; round < ROUNDS; round++) {
    distance = distanceTo(seen, lens, right, up);
    const across = seen.map(([x, , z]) => (x - right) / (distance - z));
    const upwards = seen.map(([, y, z]) => (y - up) / (distance - z));
    right += ((Math.max(...across) + Math.min(...across)) / 2) * distance;
    up += ((Math.max(...upwards) + Math.min(...upwards)) / 2) * distance;
  }
  const target = along(along(middle, axes[0], right), axes[1], up - up_tan * distance);
  return { target, distance };
}

/** Estimates the share of the image that the box covers. */
function coverage(box: Box, direction: Direction, lens: Lens): number {
  const [x, y, z] = box.max.map((v, i) => v - box.min[i]);
  const [dx, dy, dz] = towardsEye(direction).map(Math.abs);
  const silhouette = dx * y * z + dy * x * z + dz * x * y;
  return silhouette / distanceToFrame(cornersOf(box), direction, lens) ** 2;
}

export function openingView(box: Box, lens: Lens): Direction {
  const views = ASIDE_DEG.flatMap((aside) =>
    ABOVE_DEG.map((above) => ({ aside_rad: aside * DEGREE, above_rad: above * DEGREE })),
  );
  const covered = views.map((view) => coverage(box, view, lens));
  const enough = GOOD_ENOUGH * Math.max(...covered);
  return views[covered.findIndex((share) => share >= enough)];
}
