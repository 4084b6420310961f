/**
 * Which tiles the gaze and the distance bring near, from frame to frame. Pure.
 *
 * Neither flickers: a tile comes near at the switch distance and goes at 1.1 of it, and the gaze
 * has to rest on another tile for a moment.
 */
import { Matrix4, Vector3 } from "three";
import type { Clip } from "../math/clip";
import { type BoxedTile, pickTile } from "../math/pick";
import type { Ray, Vec3 } from "../math/vec3";
import type { FocusTiles } from "./representation";

/** Distance at which the focus leaves a tile, as a multiple of the one at which it was met. */
export const HYSTERESIS = 1.1;
/** Time that the gaze rests on another tile before the focus moves there, s. */
export const REST_S = 0.12;
/**
 * Most tiles that are volumes in the disc. An opening view of 5 x 2 tiles needs all ten for a disc of 12 degrees. A disc
 * near by covers one to four.
 */
export const MAX_DISC_TILES = 12;
/** Rays that feel where the disc reaches: so many rings of so many. */
const RINGS = 20;
const SPOKES = 16;

export type GazeInput = Readonly<{
  /** From the head straight ahead, um, world; the direction has unit length. */
  gaze: Ray;
  /** Tiles that can be looked at. */
  tiles: readonly BoxedTile[];
  /** What of them is left. */
  clip: Clip;
  switchDistance_um: number;
  discRadius_rad: number;
  /** Since the frame before. */
  dt_s: number;
}>;

export type FocusState = FocusTiles &
  Readonly<{
    /** What is looked at, before it has rested there. */
    glanced: string | null;
    glanced_s: number;
    /** Which tile each of the disc's rays meets first, ring by ring; null: none. */
    felt: readonly (string | null)[];
  }>;

export const FAR_AWAY: FocusState = {
  focusTile: null,
  disc: [],
  near: new Set(),
  glanced: null,
  glanced_s: 0,
  felt: [],
};

/** Distance of a point to a box; 0 inside. */
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
  const felt = near.size === 0 ? [] : feel(input);
  const disc = discTiles(felt, focusTile, before.disc, near);
  return { focusTile, disc, near, glanced, glanced_s, felt };
}

/** Whether the next frame may differ though nothing moves. */
export function isWaiting(state: FocusState): boolean {
  return state.glanced !== state.focusTile && state.glanced_s < REST_S && state.near.size > 0;
}

const ORIGIN = new Vector3();
const UP = new Vector3(0, 1, 0);
const ASIDE = new Vector3(1, 0, 0);

function feel({ gaze, tiles, clip, discRadius_rad }: GazeInput): (string | null)[] {
  const ahead = new Vector3(...gaze.direction).normalize();
  const up = Math.abs(ahead.dot(UP)) > 0.99 ? ASIDE : UP;
  const turn = new Matrix4().lookAt(ORIGIN, ahead, up);
  const felt: (string | null)[] = [];
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
      felt.push(pickTile(ray, tiles, clip)?.id ?? null);
    }
  }
  return felt;
}

/** The tiles that the rays meet, the innermost first; a tile that was there goes before a new one. */
function discTiles(
  felt: readonly (string | null)[],
  focusTile: string | null,
  before: readonly string[],
  near: ReadonlySet<string>,
): readonly string[] {
  const rings = new Map<string, number>(focusTile === null ? [] : [[focusTile, 0]]);
  felt.forEach((id, i) => {
    if (id === null || rings.has(id) || !near.has(id)) return;
    rings.set(id, 1 + Math.floor(i / SPOKES) - (before.includes(id) ? 1.5 : 0));
  });
  return [...rings]
    .sort(([, a], [, b]) => a - b)
    .slice(0, MAX_DISC_TILES)
    .map(([id]) => id);
}

/**
 * The outer radius that the disc may have now, so that it ends before the first tile without its
 * volume: a box's edge would show.
 */
export function discReach(
  { felt }: FocusState,
  discRadius_rad: number,
  isReady: (tile: string) => boolean,
): number {
  const first = felt.findIndex((id) => id !== null && !isReady(id));
  if (first === -1) return felt.length === 0 ? 0 : discRadius_rad;
  return (Math.floor(first / SPOKES) / RINGS) * discRadius_rad;
}

/**
 * The radius at which the disc ends because no more than MAX_DISC_TILES are volumes in it; null: it
 * covers no more.
 */
export function discLimit({ felt, near, disc }: FocusState, discRadius_rad: number): number | null {
  const first = felt.findIndex((id) => id !== null && near.has(id) && !disc.includes(id));
  return first === -1 ? null : (Math.floor(first / SPOKES) / RINGS) * discRadius_rad;
}
