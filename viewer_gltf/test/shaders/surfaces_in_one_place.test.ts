/** Surfaces of two channels end where the data end, in one plane. */
import { expect, it } from "vitest";
import { prepareBarePage } from "../support/browser/bare_page";
import { describeInChromium } from "../support/browser/skip";
import type { Harness } from "../support/shaders/one_place";

describeInChromium("two surfaces in one place", () => {
  const entry = new URL("../support/shaders/one_place.ts", import.meta.url);
  const bare = prepareBarePage<Harness>(entry);

  for (const [name, opacity] of [
    ["opaque", 1],
    ["translucent", 0.5],
  ] as const) {
    it(`show the first channel everywhere: ${name}`, async () => {
      expect(await bare.call("shownOfTwo", opacity)).toEqual([64 ** 2, 0]);
    });
  }
});
