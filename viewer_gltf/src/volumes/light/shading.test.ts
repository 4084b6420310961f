import { describe, expect, it } from "vitest";
import type { Size3 } from "../../bundle/ktx2";
import type { Vec3 } from "../../math/vec3";
import { gridRound, MAX_CELLS, type TileMatter, throughCells } from "./coarse_matter";
import { asTexels, lampLight, openness } from "./shading";

const SIDE = 24;
const SIZE: Size3 = [SIDE, SIDE, SIDE];
const MIDDLE = (SIDE - 1) / 2;

/** The share of light that passes each cell of a cube, from its coordinates. */
function cells(through: (x: number, y: number, z: number) => number): Float32Array {
  return Float32Array.from({ length: SIDE ** 3 }, (_, i) =>
    through(i % SIDE, Math.floor(i / SIDE) % SIDE, Math.floor(i / SIDE ** 2)),
  );
}

const at = (x: number, y: number, z: number) => (z * SIDE + y) * SIDE + x;
const unit = (v: Vec3): Vec3 => v.map((each) => each / Math.hypot(...v)) as unknown as Vec3;

describe("the light that reaches a cell", () => {
  it("is all of the light in empty space", () => {
    const empty = cells(() => 1);
    const texels = asTexels(openness(empty, SIZE, 5), lampLight(empty, SIZE, unit([-1, 2, 3])));
    expect(texels.every((byte) => byte === 255)).toBe(true);
  });

  it("is exp(-depth) behind a slab, straight and at an angle", () => {
    const depth = 0.3; // optical depth of a cell
    const slab = cells((_x, _y, z) => (z >= 14 && z < 18 ? Math.exp(-depth) : 1));
    for (const towards of [[0, 0, 1], unit([0.4, -0.3, 1]), unit([-0.6, 0.6, 0.9])] as Vec3[]) {
      const lit = lampLight(slab, SIZE, towards);
      const behind = Math.exp((-4 * depth) / towards[2]);
      expect(lit[at(12, 12, 12)]).toBeCloseTo(behind, 5);
      expect(lit[at(12, 12, 20)]).toBe(1); // in front of the slab
      const half = Math.exp((-2.5 * depth) / towards[2]); // in the middle of the slab's third cell
      expect(lit[at(12, 12, 15)]).toBeCloseTo(half, 5);
    }
  });

  it("is the same from each side", () => {
    const ball = (x: number, y: number, z: number) =>
      Math.hypot(x - MIDDLE, y - MIDDLE, z - MIDDLE) < 4 ? 0.2 : 1;
    const through = cells(ball);
    const far = (SIDE - 2) as number;
    const shade = [
      lampLight(through, SIZE, [1, 0, 0])[at(1, 12, 12)],
      lampLight(through, SIZE, [-1, 0, 0])[at(far, 12, 12)],
      lampLight(through, SIZE, [0, 1, 0])[at(12, 1, 12)],
      lampLight(through, SIZE, [0, -1, 0])[at(12, far, 12)],
      lampLight(through, SIZE, [0, 0, 1])[at(12, 12, 1)],
      lampLight(through, SIZE, [0, 0, -1])[at(12, 12, far)],
    ];
    expect(shade[0]).toBeLessThan(0.01);
    for (const each of shade) expect(each).toBeCloseTo(shade[0], 9);
  });

  it("is full in front of a flat wall, less in a corner and least in a cavity", () => {
    const open = (solid: (x: number, y: number, z: number) => boolean) =>
      openness(
        cells((...p) => (solid(...p) ? 0 : 1)),
        SIZE,
        5,
      );
    const wall = open((_x, _y, z) => z < 10);
    expect(wall[at(12, 12, 10)]).toBeGreaterThan(0.97);
    expect(wall[at(12, 12, 16)]).toBe(1); // farther away than the radius
    const corner = open((x, _y, z) => z < 10 || x < 10);
    const radius = (x: number, y: number, z: number) =>
      Math.hypot(x - MIDDLE, y - MIDDLE, z - MIDDLE);
    const shell = open((...p) => radius(...p) > 2 && radius(...p) < 6);
    expect(corner[at(10, 12, 10)]).toBeLessThan(0.9);
    expect(shell[at(12, 12, 12)]).toBeLessThan(corner[at(10, 12, 10)]);
    expect(shell[at(12, 12, 18)]).toBeGreaterThan(0.97); // outside the shell
    expect(shell[at(12, 12, 18)]).toBeGreaterThan(1.5 * shell[at(12, 12, 12)]);
  });

  it("falls with the distance of occluders by the same weights in all directions", () => {
    const far = 3;
    const seen = ([x, y, z]: Vec3) => {
      const one = cells((...p) => (p.join() === [12 + x, 12 + y, 12 + z].join() ? 0 : 1));
      return openness(one, SIZE, 5)[at(12, 12, 12)];
    };
    // a single cell takes away the weight of its direction; OPEN is the share left in front of a
    // wall
    const left = 1 - (1 / 21) * (1 - (far - 0.5) / 5);
    const axes: Vec3[] = [
      [far, 0, 0],
      [-far, 0, 0],
      [0, far, 0],
      [0, 0, -far],
    ];
    for (const place of axes) expect(seen(place)).toBeCloseTo(Math.min(1, left / 0.72), 5);
  });

  it("is the same in each run", () => {
    const through = cells((x, y, z) => ((x * 7 + y * 3 + z * 5) % 11) / 11);
    const make = () =>
      asTexels(openness(through, SIZE, 4.5), lampLight(through, SIZE, unit([1, -2, 0.5])));
    expect(make()).toEqual(make());
  });
});

describe("the grid of cells", () => {
  it("has at most the allowed number of cells, and no larger cells than needed", () => {
    for (const max of [
      [10, 10, 10],
      [67, 27, 13],
      [1000, 1, 1],
      [5, 4000, 300],
    ] as Vec3[]) {
      const { size, edge, low } = gridRound({ min: [0, 0, 0], max });
      const count = size[0] * size[1] * size[2];
      expect(count).toBeLessThanOrEqual(MAX_CELLS);
      expect(count).toBeGreaterThan(0.5 * MAX_CELLS);
      size.forEach((n, i) => {
        expect(low[i]).toBeLessThan(0);
        expect(low[i] + n * edge).toBeGreaterThan(max[i]);
      });
    }
  });

  const grid = gridRound({ min: [0, 0, 0], max: [16, 16, 16] }, 18 ** 3);

  /** A tile of 16 um with one value, whose rows run against y as in a bundle. */
  function tile(value: number, opacity: number): TileMatter {
    const opacities = new Uint8Array(256);
    opacities[value] = opacity;
    return {
      channels: [{ texels: new Uint8Array(8 ** 3).fill(value), opacities }],
      size: [8, 8, 8],
      whole: [8, 8, 8],
      low: [0, 0, 0],
      high: [1, 1, 1],
      toTexture: [1 / 16, 0, 0, 0, 0, -1 / 16, 0, 0, 0, 0, 1 / 16, 0, 0, 1, 0, 1],
      voxel_um: 0.5,
    };
  }

  it("transmits as much as the march over the length of a cell", () => {
    expect(grid.edge).toBeCloseTo(1, 2);
    const through = throughCells(grid, [tile(9, 51)], null);
    const [n] = grid.size;
    expect(through[(8 * n + 8) * n + 8]).toBeCloseTo(0.8 ** (2 * grid.edge), 5);
    expect(through[0]).toBe(1); // a cell at the corner of the grid, outside the tile
    const both = throughCells(grid, [tile(9, 51), tile(9, 51)], null);
    expect(both[(8 * n + 8) * n + 8]).toBeCloseTo(1 - 2 * (1 - 0.8 ** (2 * grid.edge)), 5);
  });

  it("reads rows against y", () => {
    const given = tile(9, 255);
    const { texels } = given.channels[0];
    texels.forEach((_, i) => {
      texels[i] = Math.floor(i / 8) % 8 < 4 ? 9 : 0; // the first rows have the highest y
    });
    const through = throughCells(grid, [given], null);
    const [n] = grid.size;
    expect(through[(8 * n + 3) * n + 8]).toBe(1);
    expect(through[(8 * n + 14) * n + 8]).toBeCloseTo(0, 3);
  });

  it("is empty where it is clipped", () => {
    const box = { min: [0, 0, 0], max: [16, 16, 8] } as const;
    const through = throughCells(grid, [tile(9, 255)], {
      box,
      plane: [1, 0, 0, 8],
      corner: [
        [-1, 0, 0, -2],
        [0, -1, 0, -4],
        [0, 0, -1, -3],
      ], // x < 2, y < 4, z < 3
    });
    const [n] = grid.size;
    expect(through[(4 * n + 8) * n + 4]).toBeCloseTo(0, 3);
    expect(through[(12 * n + 8) * n + 4]).toBe(1); // outside the box
    expect(through[(4 * n + 8) * n + 12]).toBe(1); // beyond the plane
    expect(through[(2 * n + 2) * n + 1]).toBe(1); // in the corner
    expect(through[(2 * n + 2) * n + 4]).toBeCloseTo(0, 3); // beside the corner
  });
});
