/** The tiles that a view shows too coarsely, the one in the middle of the view first. */
import { Box3, Matrix4, Vector3, Vector4 } from "three";
import type { Bounds } from "../../bundle/generated/bundle";
import { type BrickView, TEXEL_PX } from "./protocol";

export type CoarseTile = Readonly<{
  id: string;
  bounds_um: Bounds;
  texel_um: number;
}>;

/**
 * The visible tiles whose texels are longer than TEXEL_PX on the screen, by their angle to the
 * gaze.
 */
export function tilesToSharpen(tiles: readonly CoarseTile[], view: BrickView): readonly string[] {
  const eye = new Vector3(...view.eye);
  const gaze = new Vector3(...view.gaze);
  const clip = new Matrix4().fromArray(view.clip);
  return tiles
    .map(({ id, bounds_um, texel_um }) => {
      const box = new Box3(new Vector3(...bounds_um.min), new Vector3(...bounds_um.max));
      const angle = box.getCenter(new Vector3()).sub(eye).angleTo(gaze);
      return { id, angle, texel_um, distance_um: box.distanceToPoint(eye), bounds_um };
    })
    .filter(({ bounds_um, texel_um, distance_um }) => {
      const isCoarse = texel_um * view.pixels_per_radian > TEXEL_PX * distance_um;
      return isCoarse && isInSight(bounds_um, clip);
    })
    .sort((a, b) => a.angle - b.angle)
    .map(({ id }) => id);
}

/**
 * Whether a box may be in a frustum: false if all of its corners lie beyond one of the frustum's
 * planes.
 */
function isInSight({ min, max }: Bounds, clip: Matrix4): boolean {
  const corners = Array.from({ length: 8 }, (_, i) =>
    new Vector4(
      i & 1 ? max[0] : min[0],
      i & 2 ? max[1] : min[1],
      i & 4 ? max[2] : min[2],
      1,
    ).applyMatrix4(clip),
  );
  return (["x", "y", "z"] as const).every((axis) =>
    [-1, 1].every((side) => corners.some((corner) => side * corner[axis] <= corner.w)),
  );
}
