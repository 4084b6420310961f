/**
 * Bricks leave out voxels that were invisible under all functions when the bricks were requested.
 */
import { type Appearance, floorOf } from "../march_tables";
import type { TileTexture } from "../tile_texture";
import { BrickTile } from "./brick_atlas";
import { SharpenedTile } from "./sharpened_tile";

/** Whether the functions show voxels that the bricks leave out. */
export function showsBelow(
  texture: TileTexture | BrickTile | SharpenedTile,
  appearances: readonly Appearance[],
): boolean {
  if (!(texture instanceof BrickTile || texture instanceof SharpenedTile)) return false;
  const { thresholds } = texture;
  return thresholds.some(
    (threshold, c) => Math.round(255 * floorOf(appearances[c].table)) < threshold,
  );
}
