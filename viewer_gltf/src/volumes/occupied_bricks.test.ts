import { describe, expect, it } from "vitest";
import { occupiedCorners } from "./occupied_bricks";

const SIZE = [6, 3, 2] as const;
/** Shows intensities above 99. */
const OPACITIES = Uint8Array.from({ length: 256 }, (_, value) => (value > 99 ? value : 0));

/** Ranges of bricks, computed from x, y, z. */
function rangesOf(of: (x: number, y: number, z: number) => readonly [number, number]): Uint8Array {
  const [nx, ny, nz] = SIZE;
  const found: number[] = [];
  for (let z = 0; z < nz; z++) {
    for (let y = 0; y < ny; y++) for (let x = 0; x < nx; x++) found.push(...of(x, y, z));
  }
  return Uint8Array.from(found);
}

describe("the occupied region of a channel", () => {
  it("ends in the outermost bricks of its rows, which count as half full", () => {
    const ranges = rangesOf((x, y, z) => (z === 1 && y > 0 && x > 1 && x < 4 ? [0, 240] : [0, 9]));
    const corners = occupiedCorners(ranges, OPACITIES, SIZE);
    const along = (axis: number) => [...new Set(corners.map((at) => at[axis]))].sort();
    expect(along(0)).toEqual([2.25, 3.75]);
    expect(along(1)).toEqual([1.25, 1.75, 2.25, 2.75]);
    expect(along(2)).toEqual([1.25, 1.75]);
  });

  it("excludes bricks in which a single voxel of noise shows", () => {
    // noise around a body: here and there a voxel is visible
    const ranges = rangesOf((x) => (x === 3 ? [80, 255] : [2, 130]));
    const corners = occupiedCorners(ranges, OPACITIES, SIZE);
    expect(new Set(corners.map(([x]) => x))).toEqual(new Set([3.25, 3.75]));
    expect(
      occupiedCorners(
        rangesOf(() => [0, 140]),
        OPACITIES,
        SIZE,
      ),
    ).toEqual([]);
  });
});
