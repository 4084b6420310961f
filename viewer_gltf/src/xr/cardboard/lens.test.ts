import { describe, expect, it } from "vitest";
import {
  cssPixelsPerInch,
  eyeTangents,
  lensCentre,
  type Screen,
  screenOf,
  toScreen,
  undistort,
} from "./lens";
import { distort, isIncreasing } from "./lens_model";
import { CARDBOARD_V1, CARDBOARD_V2, type Profile } from "./viewer_profile";

const PHONE: Screen = { width_m: 0.14, height_m: 0.065, border_m: 0.003 };
const tan = (deg: number) => Math.tan((deg * Math.PI) / 180);

describe("the lens's distortion", () => {
  it("is the polynomial in the tangent", () => {
    expect(distort([0.441, 0.156], 0.5)).toBeCloseTo(0.5 + 0.441 * 0.125 + 0.156 * 0.03125, 12);
    expect(distort([], 0.7)).toBe(0.7);
    expect(distort([0.1, 0.2, 0.3], 1)).toBeCloseTo(1.6, 12);
  });

  it("is reversed by `undistort`", () => {
    for (const k of [[0.441, 0.156], [0.2416, 0.3012], [0.36, -0.01], [-0.05], []]) {
      for (let r = 0; r <= 2; r += 0.05) {
        expect(undistort(k, distort(k, r))).toBeCloseTo(r, 9);
      }
    }
  });

  it("is rejected if it maps two tangents to one", () => {
    expect(isIncreasing([0.36, -0.01], 2.4)).toBe(true);
    expect(isIncreasing([-1], 0.3)).toBe(true); // the maximum is 0.385, at r = 1 / sqrt(3)
    expect(isIncreasing([-1], 0.4)).toBe(false);
    expect(isIncreasing([Number.NaN], 1)).toBe(false);
  });
});

describe("the screen", () => {
  it("is computed within 1 % of the real size on known iPhones", () => {
    // iPhone 14: 2532 x 1170 at 460 dots per inch, pixel ratio 3; iPhone 11: 1792 x 828 at 326,
    // ratio 2.
    const phones = [
      [844, 390, 3, 2532 / 460, 1170 / 460],
      [896, 414, 2, 1792 / 326, 828 / 326],
    ];
    for (const [width, height, ratio, width_in, height_in] of phones) {
      const screen = screenOf(width, height, cssPixelsPerInch("... (iPhone; CPU ...", ratio));
      expect(screen.width_m / (0.0254 * width_in)).toBeCloseTo(1, 2);
      expect(screen.height_m / (0.0254 * height_in)).toBeCloseTo(1, 2);
    }
    // A Pixel 7 has 2400 x 1080 dots at 416 per inch and 915 x 412 CSS pixels: the default is 10 %
    // off at most.
    const screen = screenOf(915, 412, cssPixelsPerInch("... (Linux; Android 14; Pixel 7)", 2.625));
    expect(Math.abs(screen.width_m / (0.0254 * (2400 / 416)) - 1)).toBeLessThan(0.1);
  });
});

describe("an eye's lens", () => {
  it("lies over the screen where the Cardboard viewer puts it", () => {
    const [left, y] = lensCentre(CARDBOARD_V2, PHONE, "left");
    const [right] = lensCentre(CARDBOARD_V2, PHONE, "right");
    expect(right - left).toBeCloseTo(CARDBOARD_V2.interLens_m, 12);
    expect((left + right) / 2).toBeCloseTo(0.07, 12);
    expect(y).toBeCloseTo(0.035 - 0.003, 12);
    const at = (alignment: Profile["alignment"]) =>
      lensCentre({ ...CARDBOARD_V2, alignment }, PHONE, "left")[1];
    expect(at("center")).toBeCloseTo(0.0325, 12);
    expect(at("top")).toBeCloseTo(0.065 - 0.032, 12);
  });

  it("lies over the middle of each half if the window is too small", () => {
    const small: Screen = { width_m: 0.06, height_m: 0.03, border_m: 0.003 };
    expect(lensCentre(CARDBOARD_V2, small, "left")).toEqual([0.015, 0.015]);
    expect(lensCentre(CARDBOARD_V2, small, "right")).toEqual([0.045, 0.015]);
    const { left, right, bottom, top } = eyeTangents(CARDBOARD_V2, small, "left");
    expect(Math.min(left, right, bottom, top)).toBeGreaterThan(0.3);
  });

  it("shows its axis at its centre", () => {
    const [x, y] = toScreen(CARDBOARD_V1, PHONE, "left", 0, 0);
    expect(x * PHONE.width_m).toBeCloseTo(0.04, 12);
    expect(y * PHONE.height_m).toBeCloseTo(0.032, 12);
  });

  it("limits the view to the lens's own field of view", () => {
    const wide: Screen = { width_m: 0.3, height_m: 0.2, border_m: 0.003 };
    const { left } = eyeTangents({ ...CARDBOARD_V1, alignment: "center" }, wide, "left");
    expect(left).toBeCloseTo(tan(40), 12);
  });

  it("limits the view to the edges of the screen", () => {
    const lens = { ...CARDBOARD_V1, fov_deg: { outer: 80, inner: 80, bottom: 80, top: 80 } };
    const { left, right, bottom, top } = eyeTangents(lens, PHONE, "left");
    for (const [x, y, edge] of [
      [-left, 0, [0, 0.032 / 0.065]],
      [right, 0, [0.5, 0.032 / 0.065]], // the other eye's half begins there
      [0, -bottom, [0.04 / 0.14, 0]],
      [0, top, [0.04 / 0.14, 1]],
    ] as const) {
      const found = toScreen(lens, PHONE, "left", x, y);
      expect(found[0]).toBeCloseTo(edge[0], 9);
      expect(found[1]).toBeCloseTo(edge[1], 9);
    }
  });

  it("mirrors the other eye's lens", () => {
    const lens = { ...CARDBOARD_V2, fov_deg: { outer: 55, inner: 35, bottom: 40, top: 45 } };
    const left = eyeTangents(lens, PHONE, "left");
    const right = eyeTangents(lens, PHONE, "right");
    expect(right.left).toBeCloseTo(left.right, 12);
    expect(right.right).toBeCloseTo(left.left, 12);
    expect(right.top).toBe(left.top);
    for (const [x, y] of [
      [0.3, 0.2],
      [-0.7, 0.4],
      [0.1, -0.6],
    ]) {
      const [leftX, leftY] = toScreen(lens, PHONE, "left", x, y);
      const [rightX, rightY] = toScreen(lens, PHONE, "right", -x, y);
      expect(leftX + rightX).toBeCloseTo(1, 12);
      expect(leftY).toBeCloseTo(rightY, 12);
    }
  });

  it("draws points nearer to the axis than they are seen: a barrel, which the lens reverses", () => {
    const [centre] = toScreen(CARDBOARD_V2, PHONE, "right", 0, 0);
    const [beside] = toScreen(CARDBOARD_V2, PHONE, "right", 1, 0);
    const straight_m = CARDBOARD_V2.screenToLens_m;
    const shown_m = (beside - centre) * PHONE.width_m;
    expect(shown_m).toBeLessThan(straight_m);
    expect(distort(CARDBOARD_V2.distortion, shown_m / straight_m)).toBeCloseTo(1, 9);
  });
});
