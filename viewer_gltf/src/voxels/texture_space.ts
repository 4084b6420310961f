/** Where a volume's box lies in its texture. */
import { Vector3 } from "three";
import type { TileVolume } from "../bundle/generated/volumes";

/**
 * Texture coordinates of the low and the high corner of the box; image rows run against world y.
 */
export function textureCorners(volume: TileVolume): { low: Vector3; high: Vector3 } {
  const first = volume.size.map((n) => (volume.apron + 0.5) / n);
  const last = volume.size.map((n) => (n - volume.apron - 0.5) / n);
  return {
    low: new Vector3(first[0], last[1], first[2]),
    high: new Vector3(last[0], first[1], last[2]),
  };
}
