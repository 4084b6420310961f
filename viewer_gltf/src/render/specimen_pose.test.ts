import { Vector3 } from "three";
import { describe, expect, it } from "vitest";
import { MOVE_S, Specimen } from "./specimen_pose";

const WHOLE = { min: [0, -40, 0], max: [100, 0, 20] } as const;
const TILE = { min: [20, -20, 0], max: [40, 0, 20] } as const;
const mutable = ({ min, max }: typeof WHOLE | typeof TILE) => ({
  min: [...min] as [number, number, number],
  max: [...max] as [number, number, number],
});

/** Where a point, um, is in the scene, metres. */
const at = (specimen: Specimen, x: number, y: number, z: number) =>
  new Vector3(x, y, z).applyMatrix4(specimen.group.matrixWorld);

describe("the specimen in the scene", () => {
  it("has its centre at the anchor and a longest edge of 1.2 m", () => {
    const specimen = new Specimen(mutable(WHOLE));
    specimen.anchorAt(new Vector3(0, 0, -1));
    expect(at(specimen, 50, -20, 10).distanceTo(new Vector3(0, 0, -1))).toBeCloseTo(0, 6);
    expect(at(specimen, 100, 0, 0).distanceTo(at(specimen, 0, 0, 0))).toBeCloseTo(1.2, 6);
  });

  it("moves a tile to the middle, as large as fits in the whole specimen's place, and back", () => {
    const specimen = new Specimen(mutable(WHOLE));
    specimen.show(mutable(TILE));
    expect(specimen.advance(MOVE_S / 2)).toBe(true);
    expect(specimen.advance(MOVE_S)).toBe(false);
    expect(at(specimen, 30, -10, 10).length()).toBeCloseTo(0, 6);
    // the whole was 0.48 m high
    expect(at(specimen, 30, 0, 10).distanceTo(at(specimen, 30, -20, 10))).toBeCloseTo(0.48, 6);
    specimen.show(null);
    specimen.advance(MOVE_S);
    expect(at(specimen, 50, -20, 10).length()).toBeCloseTo(0, 6);
    expect(specimen.isMoved).toBe(false);
  });

  it("stays near the user, and returns to its home", () => {
    const specimen = new Specimen(mutable(WHOLE));
    const far = { ...specimen.pose, position: new Vector3(1000, 0, 0) };
    specimen.moveTo(far, new Vector3());
    expect(specimen.isMoved).toBe(true);
    expect(at(specimen, 50, -20, 10).length()).toBeLessThan(10);
    specimen.goHome();
    expect(at(specimen, 50, -20, 10).length()).toBeCloseTo(0, 6);
  });

  it("jumps in stereo where it would glide on a screen, and reports each jump once", () => {
    const specimen = new Specimen(mutable(WHOLE));
    specimen.takeJump();
    specimen.show(mutable(TILE));
    expect(specimen.takeJump()).toBe(false);
    specimen.advance(MOVE_S);
    specimen.isJumping = true;
    const jumps = [
      () => specimen.show(null),
      () => specimen.goHome(),
      () => specimen.anchorAt(new Vector3(0, 0, -1)),
      () => specimen.jumpTo({ ...specimen.pose, scale: 2 }, new Vector3()),
    ];
    for (const jump of jumps) {
      jump();
      expect(specimen.advance(0.1)).toBe(false);
      expect([specimen.takeJump(), specimen.takeJump()]).toEqual([true, false]);
    }
    specimen.moveTo({ ...specimen.pose, scale: 1.5 }, new Vector3());
    expect(specimen.takeJump()).toBe(false); // a hand carries it, so this is not a jump
  });
});
