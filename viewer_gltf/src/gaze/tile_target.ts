/** The specimen's tiles as what a ray meets: the boxes of those that are shown, as far as cut. */
import { Matrix4, type Object3D } from "three";
import type { Manifest } from "../bundle/generated/bundle";
import { type Clip, clipSpan } from "../view/clip";
import { rayAlong } from "./aim";
import type { Ray } from "./pick";
import type { Hit, RoomRay, Target } from "./pointer";

type Tile = Pick<Manifest["tiles"][number], "id" | "bounds_um">;
export type Shown = Readonly<{ isolated: string | null; clip: Clip }>;

const FROM_HERE = [0, Number.POSITIVE_INFINITY] as const;
export const TILE = "tile:";

/** The first tile along a ray (um), and how far it is in lengths of the ray's direction. */
export function meetTile(
  ray: Ray,
  tiles: readonly Tile[],
  { isolated, clip }: Shown,
): Readonly<{ id: string; distance: number }> | null {
  let first: { id: string; distance: number } | null = null;
  for (const { id, bounds_um } of tiles) {
    if (isolated !== null && id !== isolated) continue;
    const inBox = clipSpan(FROM_HERE, ray, { box: bounds_um, plane: null });
    const left = inBox && clipSpan(inBox, ray, clip);
    if (left !== null && left[0] < (first?.distance ?? Infinity)) {
      first = { id, distance: left[0] };
    }
  }
  return first;
}

export class TileTarget implements Target {
  readonly isOnTop = false;
  shown: Shown = { isolated: null, clip: { box: null, plane: null } };
  private readonly toSpecimen = new Matrix4();

  /** @param onChoose the ray is in um of the specimen */
  constructor(
    private readonly tiles: readonly Tile[],
    private readonly specimen: Object3D,
    private readonly onChoose: (ray: Ray, tile: string) => void,
  ) {}

  meet(ray: RoomRay): Hit | null {
    this.toSpecimen.copy(this.specimen.matrixWorld).invert();
    const met = meetTile(rayAlong(ray, this.toSpecimen), this.tiles, this.shown);
    // The ray's direction is one metre long, whatever it is in um.
    return met && { key: TILE + met.id, distance_m: met.distance };
  }

  choose({ key }: Hit, ray: RoomRay): void {
    if (key === null) return;
    this.toSpecimen.copy(this.specimen.matrixWorld).invert();
    this.onChoose(rayAlong(ray, this.toSpecimen), key.slice(TILE.length));
  }
}
