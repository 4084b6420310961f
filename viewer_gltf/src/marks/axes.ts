/** The specimen's axes: their letters, and their directions as an eye sees them. Pure. */
import { type Matrix4, Vector3 } from "three";
import type { Sides } from "../bundle/generated/bundle";
import { type Vec3, withPart } from "../math/vec3";

/** A line through the specimen; `ends` are the letters at its end along `direction`, and at the opposite end. */
export type Axis = Readonly<{
  direction: Vec3;
  ends: readonly [string, string | null];
  /** The name of `direction` for a screen reader. */
  word: string;
}>;

/** Returns the axes of the lattice of voxels, or of a patient's sides if they are known; in the order of AXIS_COLORS. */
export function axesOf(sides: Sides | undefined): readonly Axis[] {
  if (sides === undefined) {
    return (["x", "y", "z"] as const).map((name, i) => ({
      direction: withPart([0, 0, 0], i as 0 | 1 | 2, 1),
      ends: [name, null],
      word: name,
    }));
  }
  const [x, y, z] = sides.posterior;
  return [
    { direction: sides.left, ends: ["L", "R"], word: "the patient's left" },
    { direction: sides.superior, ends: ["S", "I"], word: "the head" },
    { direction: [-x, -y, -z], ends: ["A", "P"], word: "the front" },
  ];
}

/**
 * Returns the specimen's axes in the eye's frame: unit vectors with x to the right, y up and z towards the eye.
 *
 * @param head from the eye to the scene
 * @param specimen from um to the scene
 */
export function axesSeen(
  head: Matrix4,
  specimen: Matrix4,
  axes = axesOf(undefined),
): readonly Vector3[] {
  const toEye = head.clone().invert();
  return axes.map(({ direction }) =>
    new Vector3(...direction).transformDirection(specimen).transformDirection(toEye),
  );
}
