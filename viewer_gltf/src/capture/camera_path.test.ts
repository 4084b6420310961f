import { describe, expect, it } from "vitest";
import { pathThrough, turntable } from "./camera_path";

const away = ({ position, target }: ReturnType<typeof turntable>[number]) =>
  Math.hypot(...position.map((v, i) => v - target[i]));

describe("a turntable", () => {
  it("goes once around at the same distance and height, and ends just before its start", () => {
    const path = turntable({ position: [0.3, 0.4, 1.2], target: [0.1, 0, 0] }, 90);
    const [first] = path;
    first.position.forEach((v, i) => {
      expect(v).toBeCloseTo([0.3, 0.4, 1.2][i], 9);
    });
    for (const view of path) {
      expect(away(view)).toBeCloseTo(away(first), 9);
      expect(view.position[1]).toBeCloseTo(0.4, 9);
    }
    const step = (a: number, b: number) =>
      Math.hypot(...path[a].position.map((v, i) => v - path[b].position[i]));
    expect(step(89, 0)).toBeCloseTo(step(0, 1), 9);
  });
});

describe("a path through views", () => {
  const views = [
    { position: [0, 0, 2], target: [0, 0, 0] },
    { position: [1.5, 0.5, 0], target: [0.1, 0, 0] },
    { position: [0, 0, -0.8], target: [0, 0, 0] },
  ] as const;

  it("begins and ends at views, passes through the others, and stays away from the target", () => {
    const path = pathThrough(views, 121);
    for (const [i, k] of [
      [0, 0],
      [60, 1],
      [120, 2],
    ]) {
      path[i].position.forEach((v, axis) => {
        expect(v).toBeCloseTo(views[k].position[axis], 6);
      });
    }
    for (const view of path) expect(away(view)).toBeGreaterThan(0.7);
  });
});
