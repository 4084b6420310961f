import { describe, expect, it } from "vitest";
import { seeded } from "../../test/support/seeded";
import { SKIP_BRICK } from "../bundle/generated/constants";
import type { TileVolume } from "../bundle/generated/volumes";
import type { Size3 } from "../bundle/ktx2";
import { brickCounts } from "../voxels/skip_bricks";
import { assemble, brickRanges, emptyBlock, paste } from "./assemble_tiles";
import { frameOf } from "./texel_frame";

const volumeOf = ([x, y, z]: Size3) => x * y * z;

describe("tiles that are assembled into one block", () => {
  it("reproduce the volume from which they were cut", () => {
    // One lattice with two tiles along x and two along y. Each has an apron of one texel, and two channels.
    const whole: Size3 = [19, 15, 6];
    const random = seeded(1);
    const all = Uint8Array.from({ length: 2 * volumeOf(whole) }, () => Math.floor(256 * random()));
    const part = (at: Size3, size: Size3) => {
      const texels = new Uint8Array(2 * volumeOf(size));
      for (let i = 0; i < texels.length; i++) {
        const [c, t] = [i % 2, Math.floor(i / 2)];
        const x = at[0] + (t % size[0]);
        const y = at[1] + (Math.floor(t / size[0]) % size[1]);
        const z = at[2] + Math.floor(t / (size[0] * size[1]));
        texels[i] = all[2 * ((z * whole[1] + y) * whole[0] + x) + c];
      }
      return { at, whole: size, size, texels };
    };
    const parts = [
      part([0, 0, 0], [11, 9, 6]),
      part([8, 0, 0], [11, 9, 6]),
      part([0, 6, 0], [11, 9, 6]),
      part([8, 6, 0], [11, 9, 6]),
    ];
    const request = { id: 3, size: whole, finest: whole, stride: 2, channels: 2, parts };
    const made = assemble(request);
    expect(made.id).toBe(3);
    expect(made.texels).toEqual(all);
    expect(made.bricks).toHaveLength(2);
  });

  it("fill a coarser level with the nearest texel of the tile", () => {
    const finest: Size3 = [22, 10, 10];
    const size: Size3 = [11, 5, 5];
    const block = emptyBlock(size, 1);
    const texels = Uint8Array.from({ length: 6 * 5 * 5 }, (_, i) => i % 6); // 12 >> 1 along x
    paste(block, finest, { at: [10, 0, 0], whole: [12, 10, 10], size: [6, 5, 5], texels });
    expect([...block.texels.slice(0, 11)]).toEqual([0, 0, 0, 0, 0, 0, 1, 2, 3, 4, 5]);
  });

  it("leave texels empty that no tile covers", () => {
    const block = emptyBlock([6, 3, 2], 1);
    const texels = new Uint8Array(12).fill(7);
    paste(block, [6, 3, 2], { at: [2, 1, 0], whole: [3, 2, 2], size: [3, 2, 2], texels });
    const filled = [...block.texels].flatMap((v, i) =>
      v === 7 ? [[i % 6, Math.floor(i / 6) % 3]] : [],
    );
    expect(filled).toHaveLength(12);
    for (const [x, y] of filled) expect(x >= 2 && x < 5 && y >= 1).toBe(true);
  });
});

describe("the range of a brick", () => {
  it.each([[[8, 8, 8]], [[21, 9, 17]], [[1, 7, 30]]] as readonly [Size3][])(
    "spans all that a sample in it can touch: %s",
    (size) => {
      const random = seeded(size[0]);
      const stride = 3;
      const texels = Uint8Array.from({ length: stride * volumeOf(size) }, () =>
        Math.floor(256 * random()),
      );
      const [nx, ny, nz] = brickCounts(size);
      for (let channel = 0; channel < stride; channel++) {
        const found = brickRanges({ size, stride, texels }, channel);
        const expected: number[] = [];
        for (let b = 0; b < nx * ny * nz; b++) {
          const brick = [b % nx, Math.floor(b / nx) % ny, Math.floor(b / (nx * ny))];
          let [low, high] = [255, 0];
          for (let i = 0; i < volumeOf(size); i++) {
            const p = [
              i % size[0],
              Math.floor(i / size[0]) % size[1],
              Math.floor(i / (size[0] * size[1])),
            ];
            const inside = p.map((v, k) => v - SKIP_BRICK * brick[k]);
            if (inside.some((v) => v < -1 || v > SKIP_BRICK)) continue;
            low = Math.min(low, texels[stride * i + channel]);
            high = Math.max(high, texels[stride * i + channel]);
          }
          expected.push(low, high);
        }
        expect([...found]).toEqual(expected);
      }
    },
  );
});

describe("a block's frame", () => {
  const IDENTITY = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1] as TileVolume["matrix"];
  function tile(
    name: string,
    min: readonly number[],
    max: readonly number[],
    change: Partial<TileVolume> = {},
  ): TileVolume {
    const size = [0, 1, 2].map((k) => Math.round((max[k] - min[k]) / [0.5, 0.5, 2][k]) + 3);
    return {
      tile: name,
      size,
      apron: 1,
      bounds_um: { min, max },
      matrix: IDENTITY,
      levels: [],
      ...change,
    } as unknown as TileVolume;
  }
  const left = tile("left", [0, -20, 0], [16, 0, 8]);
  const right = tile("right", [16, -20, 0], [32, 0, 8]);
  const below = tile("below", [16, -30, 2], [32, -20, 8]);

  it("contains all tiles of one lattice, with rows that run against y", () => {
    const frame = frameOf([left, right, below]);
    expect(frame.min).toEqual([0, -30, 0]);
    expect(frame.max).toEqual([32, 0, 8]);
    expect(frame.spacing_um).toEqual([0.5, 0.5, 2]);
    expect(frame.size).toEqual([64 + 3, 60 + 3, 4 + 3]);
    expect([...frame.places]).toEqual([
      ["left", [0, 0, 0]],
      ["right", [32, 0, 0]],
      ["below", [32, 40, 1]],
    ]);
  });

  it("leaves out tiles that were moved separately, and tiles with another lattice", () => {
    const moved = IDENTITY.map((v, i) => (i === 12 ? 5 : v)) as unknown as TileVolume["matrix"];
    const aside = { ...right, tile: "aside", matrix: moved };
    const coarse = { ...right, tile: "coarse", size: [18, 23, 7] } as unknown as TileVolume;
    const frame = frameOf([left, aside, coarse]);
    expect([...frame.places.keys()]).toEqual(["left"]);
    expect(frame.max).toEqual([16, 0, 8]);
    expect(frame.size).toEqual(left.size);
  });

  it("keeps the matrix that all tiles share", () => {
    const matrix = [
      0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 7, 8, 9, 1,
    ] as unknown as TileVolume["matrix"];
    const frame = frameOf([left, right].map((each) => ({ ...each, matrix })));
    expect(frame.places.size).toBe(2);
    expect(frame.matrix).toEqual(matrix);
  });
});
