import type { Vec3 } from "../math/vec3";

/**
 * Orders channels by the distance of the nearest point of their boxes, farthest first. The box of a
 * channel inside another one begins farther away. If boxes begin at the same distance, the first
 * channel is drawn last, over the others.
 *
 * @param outlines points of each channel, from which its box is computed
 * @returns the turn of each channel, 0 for the one that is drawn first
 */
export function turnsOf(eye: Vec3, outlines: readonly (readonly Vec3[])[]): readonly number[] {
  const distances = outlines.map((points) => distanceToBox(eye, points));
  const order = outlines.map((_, i) => i).sort((a, b) => distances[b] - distances[a] || b - a);
  const turns = outlines.map(() => 0);
  for (const [turn, i] of order.entries()) turns[i] = turn;
  return turns;
}

function distanceToBox(eye: Vec3, points: readonly Vec3[]): number {
  const aside = eye.map((v, k) => {
    const along = points.map((point) => point[k]);
    return Math.max(Math.min(...along) - v, 0, v - Math.max(...along));
  });
  return points.length === 0 ? Infinity : Math.hypot(...aside);
}
