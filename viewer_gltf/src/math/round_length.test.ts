import { describe, expect, it } from "vitest";
import { chooseScaleBar, LONGEST_PX, umPerPixel } from "./round_length";

describe("the scale bar", () => {
  it("is a round length between 60 and 160 px at every zoom", () => {
    for (let i = 0; i <= 4000; i++) {
      const um_per_px = 10 ** (-6 + i / 400); // 1 pm to 10 mm
      const bar = chooseScaleBar(um_per_px);
      if (bar === null) throw new Error(`no bar at ${um_per_px}`);
      expect(bar.length_px).toBeGreaterThanOrEqual(60);
      expect(bar.length_px).toBeLessThanOrEqual(LONGEST_PX * (1 + 1e-9));
      expect(bar.length_px * um_per_px).toBeCloseTo(bar.length_um, 12 - Math.ceil(i / 400));
      const digits = bar.length_um.toExponential().split("e")[0];
      expect(["1", "2", "5"]).toContain(digits);
    }
  });

  it("has a label in the unit that gives the shortest number", () => {
    const labels = [0.0001, 0.004, 0.00625, 0.1, 1, 6.2, 6.25, 20, 100].map(
      (um_per_px) => chooseScaleBar(um_per_px)?.label,
    );
    expect(labels).toEqual([
      "10 nm",
      "500 nm",
      "1 µm",
      "10 µm",
      "100 µm",
      "500 µm",
      "1 mm",
      "2 mm",
      "10 mm",
    ]);
  });

  it("is null if a pixel has no size", () => {
    for (const nonsense of [0, -1, Number.NaN, Number.POSITIVE_INFINITY]) {
      expect(chooseScaleBar(nonsense)).toBeNull();
    }
  });

  it("follows from the field of view: at 90 degrees the image is twice as high as it is far away", () => {
    // at 1 m, 1000 px show 2 m of the scene, and a metre is 1000 um of the specimen
    expect(umPerPixel(1, Math.PI / 2, 1000, 0.001)).toBeCloseTo(2);
  });
});
