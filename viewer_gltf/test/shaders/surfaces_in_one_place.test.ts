/**
 * Surfaces of two channels that end in one plane, at the end of the data; and a surface that ends
 * at a volume.
 */
import { expect, it } from "vitest";
import type { Vec3 } from "../../src/math/vec3";
import { prepareBarePage } from "../support/browser/bare_page";
import { describeInChromium } from "../support/browser/skip";
import type { Harness } from "../support/shaders/one_place";

const PIXELS = 64 ** 2;
/**
 * Positions of a head that moves by millimetres, near and far, m, at which flicker would be
 * visible.
 */
const EYES: readonly Vec3[] = [1, 0.5, 2].flatMap((far) =>
  [0, 0.001, 0.002].map((aside): Vec3 => [far * 0.9 + aside, far * 0.4 - aside, far * 1.6]),
);

describeInChromium("surfaces in one place", () => {
  const entry = new URL("../support/shaders/one_place.ts", import.meta.url);
  const bare = prepareBarePage<Harness>(entry);

  for (const [name, opacity] of [
    ["opaque", 1],
    ["translucent", 0.5],
  ] as const) {
    it(`show the first channel everywhere, from any eye: ${name}`, async () => {
      const shown = await bare.call("shownOfTwo", opacity, EYES);
      expect(shown).toEqual(EYES.map(() => [PIXELS, 0]));
    });
  }

  it("end at a volume like solids that are cut there", async () => {
    const [open, flat] = [
      await bare.call("insideOfHalf", false),
      await bare.call("insideOfHalf", true),
    ];
    expect(open[1] - open[0]).toBeGreaterThan(20); // the inside of a hollow surface
    expect(flat[1] - flat[0]).toBeLessThanOrEqual(3);
    expect(flat[0]).toBeGreaterThan(open[0]);
  });
});
