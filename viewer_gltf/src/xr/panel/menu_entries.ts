/** The controls of the panel in the room, by their direction from the head. */
import { MathUtils, type Matrix4, Vector3 } from "three";
import { bearingOf, headBearing } from "./placement";

/** A control of the panel in the room: how far to the right of where the head faces, and above its level. */
export type MenuEntry = Readonly<{
  id: string;
  label: string;
  right_deg: number;
  up_deg: number;
}>;

/** @param places the controls, each with its place in the room, metres */
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
