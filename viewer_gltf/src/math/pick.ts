import { AHEAD, type Box, boxSpan } from "./box";
import { type Clip, clipSpan } from "./clip";
import type { Ray } from "./vec3";

export type BoxedTile = Readonly<{ id: string; bounds_um: Box }>;
type Boxed<B extends Box> = Readonly<{ bounds_um: B }>;
/** `distance` from the ray's origin, in multiples of the ray's direction. */
export type TileHit = Readonly<{ id: string; distance: number }>;

/** The visible tiles: all, or the isolated one. */
export function shownTiles<T extends Readonly<{ id: string }>>(
  tiles: readonly T[],
  isolated: string | null,
): readonly T[] {
  return isolated === null ? tiles : tiles.filter(({ id }) => id === isolated);
}

/** The box of the visible part: the specimen's, or the isolated tile's. */
export function shownBox<B extends Box>(
  { specimen, tiles }: Readonly<{ specimen: Boxed<B>; tiles: readonly (BoxedTile & Boxed<B>)[] }>,
  isolated: string | null,
): B {
  return (tiles.find(({ id }) => id === isolated) ?? specimen).bounds_um;
}

/** Returns the first tile along the ray (um, world) that is not clipped away there, or null. */
export function pickTile(ray: Ray, tiles: readonly BoxedTile[], clip: Clip): TileHit | null {
  const kept = clipSpan(AHEAD, ray, clip);
  if (kept === null) return null;
  let nearest = Number.POSITIVE_INFINITY;
  let picked: string | null = null;
  for (const { id, bounds_um } of tiles) {
    const span = boxSpan(AHEAD, ray, bounds_um);
    if (span === null) continue;
    const from = Math.max(span[0], kept[0]);
    const to = Math.min(span[1], kept[1]);
    // A box that is not flat but has an empty span is clipped along its face.
    const isFlat = span[0] === span[1];
    if (from >= nearest || !(from < to || (isFlat && from === to))) continue;
    nearest = from;
    picked = id;
  }
  return picked === null ? null : { id: picked, distance: nearest };
}
