import { PerspectiveCamera, Vector3 } from "three";
import { describe, expect, it } from "vitest";
import { cornersOf } from "../math/box";
import { distanceToFrame, framePoints, openingView, towardsEye } from "./opening_view";

const box = (x: number, y: number, z: number) => ({ min: [-x, -y, -z], max: [x, y, z] }) as const;
const FOV = Math.PI / 2; // half the height is 1 at distance 1
const at = (aside_deg: number, above_deg: number) => ({
  aside_rad: (aside_deg * Math.PI) / 180,
  above_rad: (above_deg * Math.PI) / 180,
});

describe("the opening view", () => {
  it("is a three-quarter view from the front, the right and above", () => {
    for (const aspect of [0.4, 1, 2.5]) {
      const [x, y, z] = towardsEye(openingView(box(3, 1, 2), { fov_rad: FOV, aspect }));
      for (const part of [x, y, z]) expect(part).toBeGreaterThan(0.2);
      expect(Math.hypot(x, y, z)).toBeCloseTo(1);
    }
  });

  it("puts a long specimen across a wide image, and into the depth of a narrow one", () => {
    const aside = (aspect: number) =>
      openingView(box(5, 2, 0.5), { fov_rad: 0.7, aspect }).aside_rad;
    expect(aside(0.5)).toBeGreaterThan(aside(1.8) + 0.5);
  });
});

describe("the distance that frames a box", () => {
  it("brings its nearest corners to the edge of the image", () => {
    // straight ahead: the front face is at distance 1 and 2 high
    expect(
      distanceToFrame(cornersOf(box(1, 1, 1)), at(0, 0), { fov_rad: FOV, aspect: 1 }),
    ).toBeCloseTo(1 + 1 / 0.94);
    // a narrow image, turned by 90 degrees: as wide as the box is deep
    expect(
      distanceToFrame(cornersOf(box(1, 1, 3)), at(90, 0), { fov_rad: FOV, aspect: 0.5 }),
    ).toBeCloseTo(1 + 3 / 0.47);
  });

  it("depends on the size of the box, not on its position", () => {
    const moved = { min: [4, 4, 4], max: [6, 8, 10] } as const;
    const lens = { fov_rad: FOV, aspect: 1.2 };
    expect(distanceToFrame(cornersOf(moved), at(35, 25), lens)).toBeCloseTo(
      distanceToFrame(cornersOf(box(1, 2, 3)), at(35, 25), lens),
    );
  });
});

describe("a framed set of points", () => {
  it("is as large as fits and in the middle, even if its box has empty corners", () => {
    // a tilted stick, whose box is mostly empty
    const stick = Array.from({ length: 50 }, (_, i) => {
      const t = (i - 24.5) / 24.5;
      return [2 + t, 1 + 0.7 * t, -0.8 * t] as const;
    });
    for (const aspect of [0.46, 1.2, 2.1]) {
      const lens = { fov_rad: 0.7, aspect };
      const direction = at(35, 25);
      const { target, distance } = framePoints(stick, direction, lens);
      const camera = new PerspectiveCamera((0.7 * 180) / Math.PI, aspect);
      camera.position
        .set(...towardsEye(direction))
        .multiplyScalar(distance)
        .add(new Vector3(...target));
      camera.lookAt(...target);
      camera.updateMatrixWorld();
      const seen = stick.map((point) => new Vector3(...point).project(camera));
      const [across, upwards] = [seen.map(({ x }) => x), seen.map(({ y }) => y)];
      const extents = [across, upwards].map((all) => [Math.min(...all), Math.max(...all)]);
      for (const [low, high] of extents) expect(low + high).toBeCloseTo(0, 2);
      expect(Math.max(...extents.map(([low, high]) => (high - low) / 2))).toBeCloseTo(0.94, 2);
    }
  });
});
