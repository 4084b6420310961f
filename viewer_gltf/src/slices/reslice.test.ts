import { Matrix4, Vector3 } from "three";
import { describe, expect, it } from "vitest";
import type { TileVolume } from "../bundle/generated/volumes";
import { AXES, type Vec3 } from "../math/vec3";
import { compose, reslice, sizeOf, type TexelBlock } from "./reslice";
import { pointIn, sliceFrames } from "./slice_frame";

const FILE = { path: "x", bytes: 0, sha256: "" };
const SIZE = [14, 12, 10] as const;

/** A tile whose texels are a linear function of their position, so that trilinear samples are exact. */
function ramp(min: Vec3, max: Vec3, matrix = new Matrix4()): TexelBlock {
  const volume: TileVolume = {
    tile: "t",
    file: FILE,
    bricks: FILE,
    size: [...SIZE],
    apron: 1,
    bounds_um: { min: [...min], max: [...max] },
    matrix: matrix.toArray() as TileVolume["matrix"],
    levels: [{ size: [...SIZE], offset: 0, length: 1, sha256: "" }],
  };
  const [nx, ny, nz] = SIZE;
  const texels = new Uint8Array(nx * ny * nz);
  for (let k = 0; k < nz; k++) {
    for (let j = 0; j < ny; j++) {
      for (let i = 0; i < nx; i++) texels[(k * ny + j) * nx + i] = 10 * i + 5 * j + 3 * k;
    }
  }
  return { volume, level: { size: SIZE, texels } };
}

/** Value of the linear ramp at a point in the tile's own space. */
function truth({ volume: { bounds_um } }: TexelBlock, point: Vec3): number | null {
  const { min, max } = bounds_um;
  const share = AXES.map((i) => (point[i] - min[i]) / (max[i] - min[i]));
  if (share.some((v) => v < 0 || v > 1)) return null;
  // inside the apron of one texel; rows run down
  return (
    10 * (1 + share[0] * (SIZE[0] - 3)) +
    5 * (1 + (1 - share[1]) * (SIZE[1] - 3)) +
    3 * (1 + share[2] * (SIZE[2] - 3))
  );
}

const BOX = { min: [0, -40, 0], max: [100, 0, 30] } as const;
const TILES = [ramp([0, -40, 0], [50, 0, 30]), ramp([50, -40, 0], [100, 0, 30])];

describe("a resliced plane", () => {
  it("has the trilinear value at each pixel in any plane, and none outside the tile", () => {
    for (const turn_deg of [
      [0, 0, 0],
      [17, -40, 65],
    ] as const) {
      for (const frame of sliceFrames({ point: [30, -12, 9], turn_deg }, BOX, null)) {
        const size = sizeOf(frame, 60);
        const values = reslice(TILES, frame, size);
        let inside = 0;
        for (let row = 0; row < size.height; row++) {
          for (let column = 0; column < size.width; column++) {
            const place = { x: (column + 0.5) / size.width, y: (row + 0.5) / size.height };
            const point = pointIn(frame, place);
            const wanted = truth(point[0] < 50 ? TILES[0] : TILES[1], point);
            const found = values[row * size.width + column];
            const isAtRim = AXES.some(
              (i) =>
                Math.min(Math.abs(point[i] - BOX.min[i]), Math.abs(point[i] - BOX.max[i])) < 0.1,
            );
            if (isAtRim || Math.abs(point[0] - 50) < 0.1) continue;
            if (wanted === null) expect(found).toBeNaN();
            else {
              expect(found).toBeCloseTo(wanted, 3);
              inside++;
            }
          }
        }
        expect(inside).toBeGreaterThan(200);
      }
    }
  });

  it("follows a tile that the stage has rotated", () => {
    const matrix = new Matrix4().makeRotationZ(0.3).setPosition(5, -3, 2);
    const tile = ramp([0, -40, 0], [50, 0, 30], matrix);
    const [frame] = sliceFrames({ point: [25, -15, 14], turn_deg: [0, 0, 0] }, BOX, null);
    const size = sizeOf(frame, 50);
    const values = reslice([tile], frame, size);
    const back = matrix.clone().invert();
    const place = { x: (20 + 0.5) / size.width, y: (8 + 0.5) / size.height };
    const own = new Vector3(...pointIn(frame, place)).applyMatrix4(back).toArray();
    expect(values[8 * size.width + 20]).toBeCloseTo(truth(tile, own) ?? -1, 3);
  });

  it("is coloured by the window, and adds up the colours of the channels", () => {
    const pixels = new Uint8ClampedArray(4 * 4);
    const values = Float32Array.from([0, 61.2, 102, Number.NaN]);
    const look = { window: [0, 0.4], color: [1, 0, 0] } as const;
    const blue = { window: [0, 1], color: [0, 0, 1] } as const;
    compose(
      [
        { values, look },
        { values: Float32Array.from([255, 0, 0, Number.NaN]), look: blue },
      ],
      pixels,
    );
    expect([...pixels]).toEqual([0, 0, 255, 255, 153, 0, 0, 255, 255, 0, 0, 255, 0, 0, 0, 0]);
  });
});
