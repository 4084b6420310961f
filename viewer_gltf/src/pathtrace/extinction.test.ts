import { describe, expect, it } from "vitest";
import { seeded } from "../../test/support/seeded";
import { randomShapes, sampled } from "../../test/support/transfer_2d";
import { SKIP_BRICK } from "../bundle/generated/constants";
import type { Size3 } from "../bundle/ktx2";
import { brickCounts } from "../voxels/skip_bricks";
import { transferTable2d } from "../voxels/transfer_table_2d";
import { brickRanges } from "./assemble_tiles";
import { coarserMajorants, majorants, mediumTable } from "./extinction";

const WHITE = [1, 1, 1] as const;

function tableOf(opacity: (i: number) => number, color = [255, 255, 255]): Uint8Array {
  return Uint8Array.from(
    Array.from({ length: 256 }, (_, i) => [...color, Math.round(opacity(i))]).flat(),
  );
}
const extinctionOf = (table: Float32Array, i: number, channel = 0) =>
  table[4 * (256 * channel + i) + 3];

describe("a medium's table", () => {
  it("absorbs the share of light in a voxel that its opacity states (Beer and Lambert)", () => {
    const voxel_um = 0.7;
    const made = mediumTable([{ color: WHITE, table: tableOf((i) => i) }], voxel_um, 1);
    for (const i of [0, 1, 100, 200, 254]) {
      expect(1 - Math.exp(-extinctionOf(made, i) * voxel_um)).toBeCloseTo(i / 255, 5);
    }
    expect(Number.isFinite(extinctionOf(made, 255))).toBe(true); // also for an opacity of 1
  });

  it("is never denser than its majorants, at any gradient", () => {
    const random = seeded(3);
    for (let run = 0; run < 40; run++) {
      const window = [0.4 * random(), 0.6 + 0.4 * random()] as const;
      const table2d = transferTable2d(
        randomShapes(random),
        { gradient_max: 0.5, functions: {} },
        window,
        random(),
      );
      const medium = mediumTable([{ color: WHITE, table: table2d.envelope, table2d }], 0.5, 2);
      const low = Math.floor(256 * random());
      const high = low + Math.floor((256 - low) * random());
      const [largest] = majorants(medium, [Uint8Array.of(low, high)]);
      for (let i = 0; i < 40; i++) {
        const value = (low + (high - low) * random()) / 255;
        const extinction = sampled(medium, value, random(), 3);
        expect(extinction).toBeLessThanOrEqual(largest * (1 + 1e-6));
      }
    }
  });

  it("multiplies the density by the given factor", () => {
    const look = { color: WHITE, table: tableOf((i) => i / 2) };
    const [one, three] = [1, 3].map((density) => mediumTable([look], 1, density));
    for (const i of [3, 90, 255]) {
      expect(extinctionOf(three, i)).toBeCloseTo(3 * extinctionOf(one, i), 5);
    }
  });

  it("has the colour of each channel, from the channel's own table", () => {
    const appearances = [
      { color: [0.2, 0.4, 0.6], table: tableOf(() => 10) },
      { color: [1, 0.5, 0], table: tableOf(() => 20, [255, 51, 0]) },
    ] as const;
    const made = mediumTable(appearances, 1, 1);
    expect(made).toHaveLength(2 * 256 * 4);
    [0.2, 0.4, 0.6].forEach((v, k) => {
      expect(made[k]).toBeCloseTo(v, 5);
    });
    [1, 0.1, 0].forEach((v, k) => {
      expect(made[4 * (256 + 7) + k]).toBeCloseTo(v, 5);
    });
  });
});

describe("majorants", () => {
  const size: Size3 = [21, 11, 17];
  const random = seeded(11);
  const stride = 2;
  const texels = Uint8Array.from({ length: size[0] * size[1] * size[2] * stride }, () =>
    Math.floor(256 * random() ** 3),
  );
  const block = { size, stride, texels };
  // Neither table rises everywhere.
  const appearances = [
    { color: WHITE, table: tableOf((i) => 100 + 90 * Math.sin(i / 9)) },
    { color: WHITE, table: tableOf((i) => (i % 50 === 7 ? 200 : 3)) },
  ];
  const table = mediumTable(appearances, 1, 2);
  const fine = majorants(table, [brickRanges(block, 0), brickRanges(block, 1)]);

  /** Returns the extinction like the GPU: linear between texels, then linear between the table's entries. */
  function extinctionAt(p: readonly number[]): number {
    let sum = 0;
    for (let c = 0; c < stride; c++) {
      let value = 0;
      for (let corner = 0; corner < 8; corner++) {
        let weight = 1;
        let at = 0;
        for (const k of [2, 1, 0]) {
          const low = Math.floor(p[k] - 0.5);
          const side = (corner >> k) & 1;
          const share = p[k] - 0.5 - low;
          weight *= side === 1 ? share : 1 - share;
          at = at * size[k] + Math.min(size[k] - 1, Math.max(0, low + side));
        }
        value += weight * texels[at * stride + c];
      }
      const left = Math.min(254, Math.floor(value));
      const [a, b] = [left, left + 1].map((i) => extinctionOf(table, i, c));
      sum += a + (b - a) * (value - left);
    }
    return sum;
  }

  it.each([1, 2, 4])("are not exceeded by any sample, for blocks of %i^3 bricks", (factor) => {
    const { majorants: found, counts } = coarserMajorants(fine, brickCounts(size), factor);
    expect(counts).toEqual(brickCounts(size).map((n) => Math.ceil(n / factor)));
    let largest = 0;
    for (let i = 0; i < 20_000; i++) {
      const p = size.map((n) => n * random());
      const cell = p.map((v) => Math.floor(v / (SKIP_BRICK * factor)));
      const majorant = found[(cell[2] * counts[1] + cell[1]) * counts[0] + cell[0]];
      const extinction = extinctionAt(p);
      expect(extinction).toBeLessThanOrEqual(majorant * (1 + 1e-5));
      largest = Math.max(largest, extinction / majorant);
    }
    expect(largest).toBeGreaterThan(0.5); // the majorants are not far too large
  });

  it("are zero in empty space", () => {
    const empty = { size, stride: 1, texels: new Uint8Array(size[0] * size[1] * size[2]) };
    const look = { color: WHITE, table: tableOf((i) => (i > 20 ? 99 : 0)) };
    const found = majorants(mediumTable([look], 1, 1), [brickRanges(empty, 0)]);
    expect(Math.max(...found)).toBe(0);
  });
});
