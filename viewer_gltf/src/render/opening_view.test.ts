import { describe, expect, it } from "vitest";
import { distanceToFrame, openingView, towardsEye } from "./opening_view";

const box = (x: number, y: number, z: number) => ({ min: [-x, -y, -z], max: [x, y, z] }) as const;
const FOV = Math.PI / 2; // half the height at distance 1 is 1
const at = (aside_deg: number, above_deg: number) => ({
  aside_rad: (aside_deg * Math.PI) / 180,
  above_rad: (above_deg * Math.PI) / 180,
});

describe("the view that a specimen opens with", () => {
  it("is one of three quarters, from the front, the right and above", () => {
    for (const aspect of [0.4, 1, 2.5]) {
      const [x, y, z] = towardsEye(openingView(box(3, 1, 2), { fov_rad: FOV, aspect }));
      for (const part of [x, y, z]) expect(part).toBeGreaterThan(0.2);
      expect(Math.hypot(x, y, z)).toBeCloseTo(1);
    }
  });

  it("has a long specimen across a wide picture, and into the depth of a narrow one", () => {
    const aside = (aspect: number) =>
      openingView(box(5, 2, 0.5), { fov_rad: 0.7, aspect }).aside_rad;
    expect(aside(0.5)).toBeGreaterThan(aside(1.8) + 0.5);
  });
});

describe("the distance that frames a box", () => {
  it("brings its nearest corners to the picture's rim", () => {
    // straight ahead: the front face is at 1, and 2 high
    expect(distanceToFrame(box(1, 1, 1), at(0, 0), { fov_rad: FOV, aspect: 1 })).toBeCloseTo(
      1 + 1 / 0.94,
    );
    // a narrow picture, turned by a quarter: as wide as the box is deep
    expect(distanceToFrame(box(1, 1, 3), at(90, 0), { fov_rad: FOV, aspect: 0.5 })).toBeCloseTo(
      1 + 3 / 0.47,
    );
  });

  it("depends on how large the box is, not on where", () => {
    const moved = { min: [4, 4, 4], max: [6, 8, 10] } as const;
    const lens = { fov_rad: FOV, aspect: 1.2 };
    expect(distanceToFrame(moved, at(35, 25), lens)).toBeCloseTo(
      distanceToFrame(box(1, 2, 3), at(35, 25), lens),
    );
  });
});
