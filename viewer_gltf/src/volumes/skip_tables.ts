/**
 * The tables by which the rays of a tile skip empty space. The table of the bundle's bricks holds for
 * every mip level. The finer table of cells holds for one level only, so it replaces the other once
 * that level is shown alone.
 */
import { Data3DTexture, NearestFilter, RedFormat, UnsignedByteType, Vector3 } from "three";
import { CELL, cellCounts } from "../bundle/cell_ranges";
import { SKIP_BRICK } from "../bundle/generated/constants";
import type { Size3 } from "../bundle/ktx2";
import { brickCounts } from "../voxels/skip_bricks";
import type { Packed } from "../voxels/tile_texture";

function distanceTexture(distances: Uint8Array<ArrayBuffer>, size: Size3): Data3DTexture {
  const texture = new Data3DTexture(distances, ...size);
  texture.format = RedFormat;
  texture.type = UnsignedByteType;
  texture.minFilter = texture.magFilter = NearestFilter;
  texture.unpackAlignment = 1;
  texture.needsUpdate = true;
  return texture;
}

export class SkipTables {
  readonly uniforms;
  /** All zeros until the table is computed, so that nothing is skipped. */
  private readonly bricks: Data3DTexture;
  private cells: Readonly<{ level: Data3DTexture; size: Size3; distances: Data3DTexture }> | null =
    null;

  /** Bricks by which the coarsest shown level spreads beyond its brick. */
  private slack = 0;

  /** @param size number of texels of mip level 0 along each axis */
  constructor(private readonly size: Size3) {
    const counts = brickCounts(size);
    const zeros = new Uint8Array(counts[0] * counts[1] * counts[2]);
    this.bricks = distanceTexture(zeros, counts);
    this.uniforms = {
      uOccupancy: { value: this.bricks },
      uSkipScale: { value: new Vector3() },
      uSkipShift: { value: 0 },
      uBrickSlack: { value: 0 },
    };
    this.useBricks(0);
  }

  /**
   * Sets the distances of the bricks, from `brickDistances`; null: nothing is skipped until they
   * are computed again, and the cells are out of date as well.
   */
  setBricks(distances: Uint8Array<ArrayBuffer> | null): void {
    const table = this.bricks.image.data as Uint8Array;
    if (distances === null) {
      table.fill(0);
      this.dropCells();
    } else {
      table.set(distances);
    }
    this.bricks.needsUpdate = true;
  }

  /** Sets the distances of the cells of a level, from `brickDistances`. */
  setCells({ texture }: Packed, distances: Uint8Array<ArrayBuffer>, size: Size3): void {
    this.dropCells();
    const table = distanceTexture(distances, cellCounts(size));
    this.cells = { level: texture, size, distances: table };
  }

  /** Chooses the table for the shown level, while it may still fade in over an old one. */
  sync(shown: Packed, old: Packed | null): void {
    const { cells } = this;
    const coarsest = Math.max(shown.level, old?.level ?? 0);
    // the value ranges of streamed bricks are those of the drawn mip level, even if it is coarse
    const isExact = coarsest === 0 || shown.index !== null;
    this.useBricks(isExact ? 0 : Math.ceil(2 ** coarsest / SKIP_BRICK));
    if (cells === null || old !== null || cells.level !== shown.texture) return;
    const { uOccupancy, uSkipScale, uSkipShift, uBrickSlack } = this.uniforms;
    uOccupancy.value = cells.distances;
    uSkipScale.value.set(...cells.size).divideScalar(CELL);
    uSkipShift.value = -0.5 / CELL; // cells begin at a texel's centre
    uBrickSlack.value = 0;
  }

  private useBricks(slack: number): void {
    this.slack = slack;
    const { uOccupancy, uSkipScale, uSkipShift, uBrickSlack } = this.uniforms;
    uOccupancy.value = this.bricks;
    uSkipScale.value.set(...this.size).divideScalar(SKIP_BRICK);
    uSkipShift.value = 0;
    uBrickSlack.value = slack;
  }

  private dropCells(): void {
    this.useBricks(this.slack);
    this.cells?.distances.dispose();
    this.cells = null;
  }

  dispose(): void {
    this.bricks.dispose();
    this.cells?.distances.dispose();
  }
}
