import { Matrix4, PerspectiveCamera, Vector3 } from "three";
import { describe, expect, it } from "vitest";
import { axesOf, axesSeen } from "../marks/axes";
import { umPerPixelAt } from "../marks/um_per_pixel";
import { rulerLength } from "./ruler";

const scaled = new Matrix4().makeScale(1e-3, 1e-3, 1e-3);

function expectNear(found: Vector3, expected: readonly number[]): void {
  found.toArray().forEach((v, i) => {
    expect(v).toBeCloseTo(expected[i]);
  });
}

describe("the axes in the eye's space", () => {
  it("lead right, up and to the eye for x, y and z if seen from the front", () => {
    const head = new Matrix4().makeTranslation(0, 0, 3);
    const seen = axesSeen(head, scaled);
    expectNear(seen[0], [1, 0, 0]);
    expectNear(seen[1], [0, 1, 0]);
    expectNear(seen[2], [0, 0, 1]);
  });

  it("follow the eye and the specimen's rotation", () => {
    // seen from the right, the axis to the right leads to the eye, and the axis to the front leads left
    const side = new Matrix4().makeRotationY(Math.PI / 2);
    const [x, y, z] = axesSeen(side, scaled);
    expectNear(x, [0, 0, 1]);
    expectNear(y, [0, 1, 0]);
    expectNear(z, [-1, 0, 0]);
    const turned = axesSeen(side, side.clone().multiply(scaled));
    expectNear(turned[0], [1, 0, 0]);
  });
});

describe("the size of a pixel in um", () => {
  it("agrees with the projection of two points at the depth of the focus", () => {
    const camera = new PerspectiveCamera(40, 1.5, 0.01, 20);
    camera.position.set(0.3, -0.2, 2);
    camera.lookAt(0.1, 0.4, -0.5);
    camera.updateMatrixWorld();
    const focus = new Vector3(0.1, 0.4, -0.5);
    const m_per_um = 1.2e-3;
    const um_per_px = umPerPixelAt(focus, camera, 500, m_per_um);
    const aside = new Vector3(1, 0, 0)
      .transformDirection(camera.matrixWorld)
      .multiplyScalar(100 * m_per_um)
      .add(focus);
    const apart = (aside.project(camera).x - focus.clone().project(camera).x) * (750 / 2);
    expect(100 / apart).toBeCloseTo(um_per_px, 9);
  });
});

describe("the ruler", () => {
  it("has a round length that fills 6 to 16 degrees of the view at any distance", () => {
    for (const distance_um of [50, 1234, 9e5]) {
      const length = rulerLength(distance_um)?.length_um ?? 0;
      expect([1, 2, 5]).toContain(Number(length.toExponential(6).split("e")[0]));
      const angle_deg = (2 * Math.atan(length / 2 / distance_um) * 180) / Math.PI;
      expect(angle_deg).toBeLessThanOrEqual(16.001);
      expect(angle_deg).toBeGreaterThan(6);
    }
    expect(rulerLength(0)).toBeNull();
  });
});

describe("a patient's axes", () => {
  const letters = (sides?: Parameters<typeof axesOf>[0]) =>
    axesOf(sides).flatMap(({ direction, ends: [forth, back] }) => [
      [forth, ...direction],
      ...(back === null ? [] : [[back, ...direction.map((part) => -part)]]),
    ]);

  it("have letters at both ends, for each of the 48 orientations along the axes", () => {
    const signs = [1, -1] as const;
    const unit = (axis: number, sign: number) => {
      const along: [number, number, number] = [0, 0, 0];
      along[axis] = sign;
      return along;
    };
    let count = 0;
    for (const [i, j, k] of [
      [0, 1, 2],
      [0, 2, 1],
      [1, 0, 2],
      [1, 2, 0],
      [2, 0, 1],
      [2, 1, 0],
    ]) {
      for (const a of signs) {
        for (const b of signs) {
          for (const c of signs) {
            const sides = { left: unit(i, a), posterior: unit(j, b), superior: unit(k, c) };
            const placed = new Map(letters(sides).map(([name, ...at]) => [name, at.join()]));
            const wanted = { L: [i, a], R: [i, -a], P: [j, b], A: [j, -b], S: [k, c], I: [k, -c] };
            for (const [name, [axis, sign]] of Object.entries(wanted)) {
              const at = placed.get(name)?.split(",").map(Number) ?? [];
              expect(at.findIndex((part) => part !== 0)).toBe(axis);
              expect(at[axis]).toBe(sign);
            }
            count++;
          }
        }
      }
    }
    expect(count).toBe(48);
  });

  it("are the x, y and z of the voxels if no side is known", () => {
    expect(letters()).toEqual([
      ["x", 1, 0, 0],
      ["y", 0, 1, 0],
      ["z", 0, 0, 1],
    ]);
  });
});
