/** Makes what shades; where only the lamp has moved, from the cells that are known. */
import type { Vec3 } from "../../math/vec3";
import { type Cut, type Grid, type TileMatter, throughCells } from "./coarse_matter";
import { asTexels, lampLight, openness } from "./shading";

/** What is to be lit. */
export type Matter = Readonly<{
  grid: Grid;
  tiles: readonly TileMatter[];
  cut: Cut | null;
  /** How far what hides the surroundings counts, um. */
  radius_um: number;
}>;

/** `matter`: null, the same as in the request before. */
export type ShadingRequest = Readonly<{ matter: Matter | null; towards: Vec3 }>;

/** Cells within which the surroundings are looked at: fewer are too coarse, more take too long. */
const RADII = [3, 6] as const;

export class ShadingMaker {
  private made: Readonly<{ grid: Grid; through: Float32Array; open: Float32Array }> | null = null;

  /** Of each cell how open and how lit it is, 0..255. */
  make({ matter, towards }: ShadingRequest): Uint8Array<ArrayBuffer> {
    if (matter !== null) {
      const { grid, tiles, cut, radius_um } = matter;
      const through = throughCells(grid, tiles, cut);
      const radius = Math.min(RADII[1], Math.max(RADII[0], radius_um / grid.edge));
      this.made = { grid, through, open: openness(through, grid.size, radius) };
    }
    if (this.made === null) throw new RangeError("expected matter with the first request");
    const { grid, through, open } = this.made;
    return asTexels(open, lampLight(through, grid.size, towards));
  }
}
