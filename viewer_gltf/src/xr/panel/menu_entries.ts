/** The controls of the headset panel by their direction from the head. */
import { MathUtils, type Matrix4, Vector3 } from "three";
import { bearingOf, headBearing } from "./placement";

/**
 * A control of the headset panel: its angle to the right of where the head faces, and above the
 * horizon.
 */
export type MenuEntry = Readonly<{
  id: string;
  label: string;
  right_deg: number;
  up_deg: number;
}>;

/** @param places position of each control in the scene, metres */
export function menuEntries(
  places: readonly Readonly<{ id: string; label: string; at: Vector3 }>[],
  head: Matrix4,
): readonly MenuEntry[] {
  const eye = new Vector3().setFromMatrixPosition(head);
  const { yaw } = headBearing(head);
  return places.map(({ id, label, at }) => {
    const bearing = bearingOf(at.sub(eye));
    return {
      id,
      label,
      right_deg: MathUtils.radToDeg(bearing.yaw - yaw),
      up_deg: MathUtils.radToDeg(bearing.pitch),
    };
  });
}
