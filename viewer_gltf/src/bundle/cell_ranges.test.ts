import { describe, expect, it } from "vitest";
import { CELL, cellCounts, cellRanges } from "./cell_ranges";
import type { Size3 } from "./ktx2";

/** Values without a pattern, always the same. */
function noise(size: Size3): Uint8Array {
  let state = 1;
  return Uint8Array.from({ length: size[0] * size[1] * size[2] }, () => {
    state = (state * 1103515245 + 12345) % 2 ** 31;
    return state >> 16;
  });
}

describe("the ranges of cells", () => {
  it.each<[Size3, Size3]>([
    [
      [1, 1, 1],
      [1, 1, 1],
    ],
    [
      [2, 5, 6],
      [1, 1, 2],
    ],
    [
      [9, 10, 13],
      [2, 3, 3],
    ],
  ])("have as many cells as lie between the texels of %s", (size, counts) => {
    expect(cellCounts(size)).toEqual(counts);
    expect(cellRanges(noise(size), size)).toHaveLength(2 * counts[0] * counts[1] * counts[2]);
  });

  it.each<Size3>([
    [1, 1, 1],
    [2, 5, 6],
    [9, 10, 13],
    [17, 3, 8],
  ])("are those of all texels that a sample in the cell reads: %i x %i x %i", (...size) => {
    const texels = noise(size);
    const [nx, ny, nz] = size;
    const [cx, cy, cz] = cellCounts(size);
    const found = cellRanges(texels, size);
    for (let cell = 0; cell < cx * cy * cz; cell++) {
      const at = [cell % cx, Math.floor(cell / cx) % cy, Math.floor(cell / (cx * cy))];
      const inside: number[] = [];
      for (let i = 0; i < texels.length; i++) {
        const texel = [i % nx, Math.floor(i / nx) % ny, Math.floor(i / (nx * ny))];
        const isIn = texel.every((v, k) => v >= CELL * at[k] && v <= CELL * (at[k] + 1));
        if (isIn) inside.push(texels[i]);
      }
      expect(nz).toBeGreaterThan(0);
      expect([...found.slice(2 * cell, 2 * cell + 2)]).toEqual([
        Math.min(...inside),
        Math.max(...inside),
      ]);
    }
  });
});
