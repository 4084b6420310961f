/** A tile's volume for small programs: a cube of voxels with a spacing of one um. */
import type { TileVolume } from "../../../src/bundle/generated/volumes";

/** Pixels of the frame along each edge. */
export const PIXELS = 64;

/** Returns a cube of `side` texels along each edge, whose lower corner is at x = `left_um`. */
export function cube(side: number, left_um = 0): TileVolume {
  const file = { path: "x", bytes: 0, sha256: "" };
  const edge = side - 3; // lattice intervals without the apron, one um each
  return {
    tile: "r0_c0",
    file,
    bricks: file,
    size: [side, side, side],
    apron: 1,
    bounds_um: { min: [left_um, -edge, 0], max: [left_um + edge, 0, edge] },
    matrix: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1],
    levels: [{ size: [side, side, side], offset: 0, length: 1, sha256: "" }],
  };
}
