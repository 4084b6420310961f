/** Points of the shown part of the specimen, in the scene. */
import { type Matrix4, Vector3 } from "three";
import type { BoxedTile } from "../math/pick";

/** Corners of the box around the tiles, midpoints of its edges and faces, and its centre. */
export function hullOf(tiles: readonly BoxedTile[], toScene: Matrix4): readonly Vector3[] {
  const [xs, ys, zs] = ([0, 1, 2] as const).map((axis) => {
    const low = Math.min(...tiles.map(({ bounds_um }) => bounds_um.min[axis]));
    const high = Math.max(...tiles.map(({ bounds_um }) => bounds_um.max[axis]));
    return [low, (low + high) / 2, high];
  });
  return xs.flatMap((x) =>
    ys.flatMap((y) => zs.map((z) => new Vector3(x, y, z).applyMatrix4(toScene))),
  );
}

export function middleOf(points: readonly Vector3[]): Vector3 {
  const sum = points.reduce((total, point) => total.add(point), new Vector3());
  return sum.divideScalar(Math.max(1, points.length));
}
