import { describe, expect, it } from "vitest";
import type { MipLevel } from "../bundle/generated/volumes";
import { levelsToFetch } from "./mip_levels";

/** A full mip chain: each level is half as large as the previous one. */
function chain(x: number, y: number, z: number): MipLevel[] {
  const levels: MipLevel[] = [];
  for (let k = 0; ; k++) {
    const size = [x, y, z].map((n) => Math.max(1, n >> k)) as [number, number, number];
    levels.push({ size, offset: 0, length: 1, sha256: "" });
    if (Math.max(...size) === 1) return levels;
  }
}

describe("the levels to fetch", () => {
  it("go from a small level to the finest", () => {
    // 128 x 128 x 64: level 2 is 32 x 32 x 16 = 16 KiB, level 1 128 KiB.
    expect(levelsToFetch(chain(128, 128, 64), 1e9, 2048)).toEqual([2, 1, 0]);
  });

  it("stop at the budget", () => {
    expect(levelsToFetch(chain(128, 128, 64), 128 * 1024, 2048)).toEqual([2, 1]);
    expect(levelsToFetch(chain(128, 128, 64), 1024, 2048)).toEqual([4]);
  });

  it("stop at the largest texture that the GPU supports", () => {
    expect(levelsToFetch(chain(512, 8, 8), 1e9, 256)).toEqual([1]);
  });

  it("are only the finest level for a tiny volume", () => {
    expect(levelsToFetch(chain(8, 8, 8), 1e9, 2048)).toEqual([0]);
  });

  it("are never empty", () => {
    expect(levelsToFetch(chain(64, 64, 64).slice(0, 1), 10, 16)).toEqual([0]);
  });
});
