/** Bricks leave out voxels that no function showed when they were asked for. */
import { type Appearance, floorOf } from "../march_tables";
import type { TileTexture } from "../tile_texture";
import { BrickTile } from "./brick_atlas";

/** Whether functions show what bricks leave out. */
export function showsBelow(
  texture: TileTexture | BrickTile,
  appearances: readonly Appearance[],
): boolean {
  if (!(texture instanceof BrickTile)) return false;
  const { thresholds } = texture;
  return appearances.some(({ table }, c) => Math.round(255 * floorOf(table)) < thresholds[c]);
}
