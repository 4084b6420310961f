/**
 * Chooses the tiles that are near enough to be volumes, from frame to frame. Pure.
 *
 * The choice does not flicker: a tile becomes near at the switch distance and stops being near at
 * 1.1 times that distance. The focus moves to another tile only after the gaze has rested on it.
 */
import { Matrix4, Vector3 } from "three";
import type { Clip } from "../math/clip";
import { type BoxedTile, pickTile } from "../math/pick";
import type { Ray, Vec3 } from "../math/vec3";
import type { FocusTiles } from "./representation";

/** Factor to the switch distance beyond which a tile stops being near. */
export const HYSTERESIS = 1.1;
/** Seconds that the gaze rests on another tile before the focus moves there. */
export const REST_S = 0.12;
/**
 * Largest number of tiles that are volumes in the disc. An opening view of 5 x 2 tiles needs all
 * ten for a disc of 12 degrees; close to the specimen a disc covers one to four.
 */
export const MAX_DISC_TILES = 12;
/** Rays that sample the disc: rings, and rays on each ring. */
const RINGS = 20;
const SPOKES = 16;

export type GazeInput = Readonly<{
  /** Ray from the head straight ahead, um, world; its direction has unit length. */
  gaze: Ray;
  /** Tiles that the gaze can meet. */
  tiles: readonly BoxedTile[];
  /** Cuts that remove part of the tiles. The gaze does not stop at what they remove. */
  clip: Clip;
  switchDistance_um: number;
  discRadius_rad: number;
  /** Time since the previous frame, s. */
  dt_s: number;
}>;

export type FocusState = FocusTiles &
  Readonly<{
    /** Tile that the gaze meets now; the focus moves there if it stays. null: none. */
    glanced: string | null;
    glanced_s: number;
    /** First tile that each ray of the disc meets, ring by ring; null: none. */
    rayTiles: readonly (string | null)[];
  }>;

export const FAR_AWAY: FocusState = {
  focusTile: null,
  disc: [],
  near: new Set(),
  glanced: null,
  glanced_s: 0,
  rayTiles: [],
};

/** Returns the distance from a point to a box; 0 inside. */
function distanceTo(point: Vec3, { min, max }: BoxedTile["bounds_um"]): number {
  const off = point.map((v, i) => Math.max(min[i] - v, 0, v - max[i]));
  return Math.hypot(off[0], off[1], off[2]);
}

export function advanceFocus(before: FocusState, input: GazeInput): FocusState {
  const { gaze, switchDistance_um } = input;
  const near = new Set<string>();
  for (const { id, bounds_um } of input.tiles) {
    const limit = switchDistance_um * (before.near.has(id) ? HYSTERESIS : 1);
    if (distanceTo(gaze.origin, bounds_um) < limit) near.add(id);
  }
  const glanced = pickTile(gaze, input.tiles, input.clip)?.id ?? null;
  const glanced_s = glanced === before.glanced ? before.glanced_s + input.dt_s : 0;
  const isFirst = before.focusTile === null || !near.has(before.focusTile);
  const settled = glanced_s >= REST_S || (isFirst && glanced !== null) ? glanced : before.focusTile;
  const focusTile = settled !== null && near.has(settled) ? settled : null;
  const rayTiles = near.size === 0 ? [] : sampleDisc(input);
  const disc = discTiles(rayTiles, focusTile, before.disc, near);
  return { focusTile, disc, near, glanced, glanced_s, rayTiles };
}

/**
 * Returns whether the next frame may differ although nothing moves: the gaze is resting on another
 * tile.
 */
export function isWaiting(state: FocusState): boolean {
  return state.glanced !== state.focusTile && state.glanced_s < REST_S && state.near.size > 0;
}

const ORIGIN = new Vector3();
const UP = new Vector3(0, 1, 0);
const ASIDE = new Vector3(1, 0, 0);

function sampleDisc({ gaze, tiles, clip, discRadius_rad }: GazeInput): (string | null)[] {
  const ahead = new Vector3(...gaze.direction).normalize();
  const up = Math.abs(ahead.dot(UP)) > 0.99 ? ASIDE : UP;
  const turn = new Matrix4().lookAt(ORIGIN, ahead, up);
  const rayTiles: (string | null)[] = [];
  const direction = new Vector3();
  for (let ring = 1; ring <= RINGS; ring++) {
    const angle = (ring / RINGS) * discRadius_rad;
    for (let spoke = 0; spoke < SPOKES; spoke++) {
      const around = (2 * Math.PI * spoke) / SPOKES;
      direction
        .set(Math.sin(angle) * Math.cos(around), Math.sin(angle) * Math.sin(around), -1)
        .setZ(-Math.cos(angle))
        .transformDirection(turn);
      const ray = { origin: gaze.origin, direction: direction.toArray() };
      rayTiles.push(pickTile(ray, tiles, clip)?.id ?? null);
    }
  }
  return rayTiles;
}

/**
 * Returns the near tiles that the rays meet, innermost first. Tiles that were in the disc before
 * are preferred.
 */
function discTiles(
  rayTiles: readonly (string | null)[],
  focusTile: string | null,
  before: readonly string[],
  near: ReadonlySet<string>,
): readonly string[] {
  const rings = new Map<string, number>(focusTile === null ? [] : [[focusTile, 0]]);
  rayTiles.forEach((id, i) => {
    if (id === null || rings.has(id) || !near.has(id)) return;
    rings.set(id, 1 + Math.floor(i / SPOKES) - (before.includes(id) ? 1.5 : 0));
  });
  return [...rings]
    .sort(([, a], [, b]) => a - b)
    .slice(0, MAX_DISC_TILES)
    .map(([id]) => id);
}

/**
 * Returns the largest radius of the focus disc, in radians, that contains no tile whose volume is
 * not loaded. A larger disc would show the edge of that tile's box.
 */
export function discReach(
  { rayTiles }: FocusState,
  discRadius_rad: number,
  isReady: (tile: string) => boolean,
): number {
  const first = rayTiles.findIndex((id) => id !== null && !isReady(id));
  if (first === -1) return rayTiles.length === 0 ? 0 : discRadius_rad;
  return (Math.floor(first / SPOKES) / RINGS) * discRadius_rad;
}

/**
 * Returns the largest radius of the focus disc that MAX_DISC_TILES allows; null if the whole disc
 * covers no more tiles.
 */
export function discLimit(
  { rayTiles, near, disc }: FocusState,
  discRadius_rad: number,
): number | null {
  const first = rayTiles.findIndex((id) => id !== null && near.has(id) && !disc.includes(id));
  return first === -1 ? null : (Math.floor(first / SPOKES) / RINGS) * discRadius_rad;
}
