import { describe, expect, it } from "vitest";
import { ENTRIES, edgeContrast } from "./transfer_luts";

/** A table whose opacity rises linearly from one entry to another, and then stays. */
function risingTable(from: number, to: number): Uint8Array {
  const table = new Uint8Array(4 * ENTRIES);
  for (let i = 0; i < ENTRIES; i++) {
    table[4 * i + 3] = 200 * Math.min(1, Math.max(0, (i - from) / (to - from)));
  }
  return table;
}

describe("the contrast of shaded edges", () => {
  it("is 1 if the opacity rises gently", () => {
    expect(edgeContrast(risingTable(60, 200))).toBe(1);
  });

  it("grows if the opacity rises within fewer intensities, up to 3", () => {
    const some = edgeContrast(risingTable(60, 90));
    expect(some).toBeGreaterThan(1.5);
    expect(edgeContrast(risingTable(60, 75))).toBeGreaterThan(some);
    expect(edgeContrast(risingTable(60, 61))).toBe(3);
  });

  it("is 1 for a table that shows everything or nothing", () => {
    expect(edgeContrast(new Uint8Array(4 * ENTRIES).fill(255))).toBe(1);
    expect(edgeContrast(new Uint8Array(4 * ENTRIES))).toBe(1);
  });
});
