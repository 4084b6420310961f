/** Compares the letters at a slice's edges with its pixels. Confusing left and right would endanger a patient. */
import { Matrix4 } from "three";
import { describe, expect, it } from "vitest";
import type { TileVolume } from "../bundle/generated/volumes";
import { AXES, dot, type Vec3 } from "../math/vec3";
import { compose, GREY, reslice, sizeOf, type TexelBlock } from "./reslice";
import { sliceFrames } from "./slice_frame";

const FILE = { path: "x", bytes: 0, sha256: "" };
const SIZE = [17, 15, 13] as const;
const BOX = { min: [-30, 10, 5], max: [50, 70, 45] } as const;
const MIDDLE: Vec3 = [10, 40, 25];
/** Brightness of the phantom at its left, its back and its top, 0..255; the rest is dark. */
const BRIGHT = { L: 200, P: 120, S: 60, R: 0, A: 0, I: 0 } as const;

type Sides = Readonly<{ left: Vec3; posterior: Vec3; superior: Vec3 }>;

/** All orientations along the axes, including mirrored ones. */
const ORIENTATIONS: readonly Sides[] = AXES.flatMap((i) =>
  AXES.filter((j) => j !== i).flatMap((j) =>
    Array.from({ length: 8 }, (_, signs) => {
      const along = (axis: number, bit: number): Vec3 => {
        const sign = signs & bit ? -1 : 1;
        return [axis === 0 ? sign : 0, axis === 1 ? sign : 0, axis === 2 ? sign : 0];
      };
      return { left: along(i, 1), posterior: along(j, 2), superior: along(3 - i - j, 4) };
    }),
  ),
);

/** The same body in each orientation in the box. */
function phantom({ left, posterior, superior }: Sides): TexelBlock {
  const volume: TileVolume = {
    tile: "t",
    file: FILE,
    bricks: FILE,
    size: [...SIZE],
    apron: 1,
    bounds_um: { min: [...BOX.min], max: [...BOX.max] },
    matrix: new Matrix4().toArray() as TileVolume["matrix"],
    levels: [{ size: [...SIZE], offset: 0, length: 1, sha256: "" }],
  };
  const [nx, ny, nz] = SIZE;
  const texels = new Uint8Array(nx * ny * nz);
  // from -1 to 1 through the box, within an apron of one texel
  const share = (i: number, n: number) => (2 * (i - 1)) / (n - 3) - 1;
  for (let k = 0; k < nz; k++) {
    for (let j = 0; j < ny; j++) {
      for (let i = 0; i < nx; i++) {
        const at: Vec3 = [share(i, nx), -share(j, ny), share(k, nz)]; // rows run down
        const value =
          dot(at, left) > 0.5
            ? BRIGHT.L
            : dot(at, posterior) > 0.5
              ? BRIGHT.P
              : dot(at, superior) > 0.5
                ? BRIGHT.S
                : 0;
        texels[(k * ny + j) * nx + i] = value;
      }
    }
  }
  return { volume, level: { size: SIZE, texels } };
}

describe("a slice's letters", () => {
  it("stand at the sides that its pixels show, for each of the 48 orientations", () => {
    expect(new Set(ORIENTATIONS.map((sides) => JSON.stringify(sides))).size).toBe(48);
    for (const sides of ORIENTATIONS) {
      const block = phantom(sides);
      for (const frame of sliceFrames({ point: MIDDLE, turn_deg: [0, 0, 0] }, BOX, sides)) {
        const size = sizeOf(frame, 40);
        const { width, height } = size;
        const pixels = new Uint8ClampedArray(4 * width * height);
        const values = reslice([block], frame, size);
        compose([{ values, look: { window: [0, 1], color: GREY } }], pixels);
        const at = (x: number, y: number) => {
          const pixel = Math.floor(y * height) * width + Math.floor(x * width);
          return pixels[4 * pixel];
        };
        // in the middle of each edge, a tenth of the picture inwards
        const seen = [at(0.1, 0.5), at(0.9, 0.5), at(0.5, 0.1), at(0.5, 0.9)];
        const expected = frame.ends.map((letter) => BRIGHT[letter as keyof typeof BRIGHT]);
        expect(seen, `${frame.name} of ${JSON.stringify(sides)}`).toEqual(expected);
      }
    }
  });
});
