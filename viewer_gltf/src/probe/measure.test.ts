import { describe, expect, it } from "vitest";
import type { TileVolume } from "../bundle/generated/volumes";
import type { Size3 } from "../bundle/ktx2";
import { distanceBetween } from "../math/distance";
import {
  measuredText,
  measurementText,
  type VolumeLevel,
  valueAt,
  valueText,
  voxelAt,
} from "./measure";

const IDENTITY: TileVolume["matrix"] = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
const FILE = { path: "x", bytes: 0, sha256: "" };

/** 10 x 6 x 5 texels with an apron of one: 7 x 3 x 2 intervals of 0.5, 0.5 and 1 um. */
function tile(matrix = IDENTITY): TileVolume {
  return {
    tile: "r0_c0",
    file: FILE,
    bricks: FILE,
    size: [10, 6, 5],
    apron: 1,
    bounds_um: { min: [10, -11.5, 2], max: [13.5, -10, 4] },
    matrix,
    levels: [{ size: [10, 6, 5], offset: 0, length: 1, sha256: "" }],
  };
}

function fill(size: Size3, at: (i: number, j: number, k: number) => number): VolumeLevel {
  const [nx, ny, nz] = size;
  const texels = new Uint8Array(nx * ny * nz);
  for (let k = 0; k < nz; k++)
    for (let j = 0; j < ny; j++)
      for (let i = 0; i < nx; i++) texels[(k * ny + j) * nx + i] = at(i, j, k);
  return { size, texels };
}

describe("the value at a point", () => {
  // Trilinear interpolation reproduces a ramp along each axis exactly.
  const ramp = fill([10, 6, 5], (i, j, k) => 10 * i + 7 * j + 20 * k);
  // Texel 1 lies on the low corner, and rows run in the direction of -y of the world.
  const expected = (x: number, y: number, z: number) =>
    10 * (1 + (x - 10) / 0.5) + 7 * (1 + (-10 - y) / 0.5) + 20 * (1 + (z - 2));

  it("follows a linear ramp between the texels, up to the edge of the tile", () => {
    for (const x of [10, 10.2, 12.99, 13.5])
      for (const y of [-11.5, -10.9, -10])
        for (const z of [2, 2.6, 4]) {
          const value = valueAt(tile(), ramp, [0, 255], [x, y, z]);
          expect(value).toBeCloseTo(expected(x, y, z), 9);
        }
  });

  it("is on the source's scale", () => {
    const value = valueAt(tile(), ramp, [1000, 1510], [10, -10, 2]);
    expect(value).toBeCloseTo(1000 + 2 * 37);
  });

  it("belongs to the voxel whose centre is nearest to the point", () => {
    expect(voxelAt(tile(), [10.24, -10.26, 2.4])).toEqual([10, -10.5, 2]);
    expect(voxelAt(tile(), [13.5, -11.5, 4])).toEqual([13.5, -11.5, 4]);
    expect(voxelAt(tile(), [13.6, -11.5, 4])).toBeNull();
    // The tile is turned by a quarter about z, then moved 100 um along x. The voxel is given in the tile's own frame.
    const moved = tile([0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 100, 0, 0, 1]);
    expect(voxelAt(moved, [100 + 10.9, 12.3, 3])).toEqual([12.5, -11, 3]);
  });

  it("is written with all digits if it was measured", () => {
    expect(measuredText(-1023, "HU")).toBe("-1023 HU");
    expect(measuredText(0.1)).toBe("0.1");
  });

  it("is null outside the tile", () => {
    for (const p of [
      [9.9, -11, 3],
      [12, -9.9, 3],
      [12, -11, 4.1],
    ] as const) {
      expect(valueAt(tile(), ramp, [0, 255], p)).toBeNull();
    }
  });

  it("follows a tile that was moved and turned in the stage", () => {
    // The tile is turned by a quarter about z (x to y, y to -x), then moved 100 um along x.
    const moved = tile([0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 100, 0, 0, 1]);
    const value = valueAt(moved, ramp, [0, 255], [100 + 10.9, 12.3, 3]);
    expect(value).toBeCloseTo(expected(12.3, -10.9, 3), 9);
    expect(valueAt(moved, ramp, [0, 255], [12.3, -10.9, 3])).toBeNull();
  });

  it("comes from a coarser level at the same place", () => {
    const half = fill([5, 3, 2], (i) => 50 * i);
    // Both levels cover the same box, so that u = (i + 0.5) / n is the same in both.
    const texel = 1 + (12 - 10) / 0.5;
    const expectedHalf = 50 * (((texel + 0.5) / 10) * 5 - 0.5);
    expect(valueAt(tile(), half, [0, 255], [12, -11, 3])).toBeCloseTo(expectedHalf, 9);
  });

  it("is read from one of several interleaved channels", () => {
    const texels = new Uint8Array(4 * ramp.texels.length);
    ramp.texels.forEach((value, i) => {
      texels.set([255, 0, value, 9], 4 * i);
    });
    const packed = { size: ramp.size, texels, stride: 4, channel: 2 };
    const value = valueAt(tile(), packed, [0, 255], [12.1, -10.6, 3.3]);
    expect(value).toBeCloseTo(expected(12.1, -10.6, 3.3), 9);
  });

  it("is defined in a volume of one texel", () => {
    const flat: TileVolume = {
      ...tile(),
      size: [1, 1, 1],
      apron: 0,
      bounds_um: { min: [1, 1, 1], max: [1, 1, 1] },
    };
    const one = fill([1, 1, 1], () => 51);
    expect(valueAt(flat, one, [0, 10], [1, 1, 1])).toBeCloseTo(2);
    expect(valueAt(flat, one, [0, 10], [1, 2, 1])).toBeNull();
  });

  it("is written with the digits that 8 bits hold", () => {
    expect(valueText(1234.56, [0, 65535])).toBe("1235");
    expect(valueText(0.123456, [0, 1])).toBe("0.123");
    expect(valueText(12.3456, [0, 255])).toBe("12");
    expect(valueText(12.3456, [0, 100])).toBe("12.3");
    expect(valueText(7, [7, 7])).toBe("7");
  });
});

describe("the distance of two points", () => {
  it("is Euclid's, in um", () => {
    expect(distanceBetween([1, 2, 3], [3, 5, 9])).toBe(7);
  });

  it("is written as a text, like an angle and the length of a line", () => {
    const line = [
      [0, 0, 0],
      [3, 4, 0],
      [3, 4, 5],
    ] as const;
    expect(measurementText("distance", line.slice(0, 2))).toBe("5.00 µm");
    expect(measurementText("line", line)).toBe("10.0 µm, 3 points");
    expect(measurementText("angle", line)).toBe("90.0°");
  });

  it("has a unit of values where the source states one", () => {
    expect(valueText(-1000.4, [-1024, 2000], "HU")).toBe("-1000 HU");
  });
});
