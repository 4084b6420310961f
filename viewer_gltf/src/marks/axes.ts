/** The specimen's axes: their letters, and where they lead as an eye sees them. Pure. */
import { type Matrix4, Vector3 } from "three";
import type { Sides } from "../bundle/generated/bundle";
import { type Vec3, withPart } from "../math/vec3";

/** A line through the specimen: `ends` are the letters where `direction` leads to, and opposite. */
export type Axis = Readonly<{
  direction: Vec3;
  ends: readonly [string, string | null];
  /** Where `direction` leads, for a screen reader. */
  word: string;
}>;

/** The lattice's axes, or where a patient's sides are; in the colours' order. */
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
 * The specimen's axes as the eye sees them: unit vectors, x to the right, y up, z to the eye. Pure.
 *
 * @param head from the eye to the room
 * @param specimen from um to the room
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
