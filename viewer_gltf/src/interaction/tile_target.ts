/** The specimen's tiles as what a ray meets: the boxes of those that are shown, as far as cut. */
import { Matrix4, type Object3D } from "three";
import { type Clip, WHOLE } from "../math/clip";
import { type BoxedTile, pickTile } from "../math/pick";
import type { Ray } from "../math/vec3";
import type { Hit, RoomRay, Target } from "./ray_pointer";
import { rayAlong } from "./rays";

export const TILE = "tile:";

export class TileTarget implements Target {
  readonly isOnTop = false;
  /** Those that are shown. */
  tiles: readonly BoxedTile[] = [];
  clip: Clip = WHOLE;
  private readonly toSpecimen = new Matrix4();

  /** @param onChoose the ray is in um of the specimen */
  constructor(
    private readonly specimen: Object3D,
    private readonly onChoose: (ray: Ray, tile: string, isByGaze: boolean) => void,
  ) {}

  meet(ray: RoomRay): Hit | null {
    this.toSpecimen.copy(this.specimen.matrixWorld).invert();
    const met = pickTile(rayAlong(ray, this.toSpecimen), this.tiles, this.clip);
    // The ray's direction is one metre long, whatever it is in um.
    return met && { key: TILE + met.id, distance_m: met.distance };
  }

  choose({ key }: Hit, ray: RoomRay, isByGaze: boolean): void {
    if (key === null) return;
    this.toSpecimen.copy(this.specimen.matrixWorld).invert();
    this.onChoose(rayAlong(ray, this.toSpecimen), key.slice(TILE.length), isByGaze);
  }
}
