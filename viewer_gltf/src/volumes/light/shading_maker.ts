/** Computes shading; if only the lamp has moved, from the cells that are already computed. */
import type { Vec3 } from "../../math/vec3";
import { type Cut, type Grid, type TileMatter, throughCells } from "./coarse_matter";
import { asTexels, lampLight, openness } from "./shading";

export type Matter = Readonly<{
  grid: Grid;
  tiles: readonly TileMatter[];
  cut: Cut | null;
  /** Radius of the ambient occlusion, um. */
  radius_um: number;
}>;

/** `matter`: null if it is the same as in the last request. */
export type ShadingRequest = Readonly<{ matter: Matter | null; towards: Vec3 }>;

/**
 * Limits of the occlusion's radius, in cells: a smaller one is too coarse, a larger one takes too
 * long.
 */
const RADII = [3, 6] as const;

export class ShadingMaker {
  private made: Readonly<{ grid: Grid; through: Float32Array; open: Float32Array }> | null = null;

  /** Openness and light of each cell, 0 to 255, interleaved. */
  make({ matter, towards }: ShadingRequest): Uint8Array<ArrayBuffer> {
    if (matter !== null) {
      const { grid, tiles, cut, radius_um } = matter;
      const through = throughCells(grid, tiles, cut);
      const radius = Math.min(RADII[1], Math.max(RADII[0], radius_um / grid.edge));
      this.made = { grid, through, open: openness(through, grid.size, radius) };
    }
    if (this.made === null)
      throw new RangeError("the first shading request has no matter, expected grid and tiles");
    const { grid, through, open } = this.made;
    return asTexels(open, lampLight(through, grid.size, towards));
  }
}
