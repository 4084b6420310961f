/** Converts the stage's cameras to saved views. Pure. */
import type { Manifest } from "../bundle/generated/bundle";
import { FIELD_OF_VIEW_DEG } from "../interaction/named_views";
import type { Vec3 } from "../math/vec3";
import { place } from "../render/placement";
import { type KeptView, MAX_VIEWS } from "../state/kept_views";

const halfTan = (degrees: number) => Math.tan((degrees * Math.PI) / 360);

/**
 * Returns the views in metres of the scene. The viewer's field of view is fixed, so that its camera is nearer or farther
 * than the stage's camera, to show the same extent at the target.
 */
export function stageViews({ views, specimen }: Manifest): readonly KeptView[] {
  const { center, scale } = place(specimen.bounds_um);
  const toScene = (point: Vec3): Vec3 => [
    (point[0] - center[0]) * scale,
    (point[1] - center[1]) * scale,
    (point[2] - center[2]) * scale,
  ];
  return (views ?? []).slice(0, MAX_VIEWS).map(({ name, position_um, target_um, fov_deg }) => {
    const [eye, target] = [toScene(position_um), toScene(target_um)];
    const nearer = halfTan(fov_deg) / halfTan(FIELD_OF_VIEW_DEG);
    const along = (i: 0 | 1 | 2) => target[i] + nearer * (eye[i] - target[i]);
    return { name, target, position: [along(0), along(1), along(2)] };
  });
}
