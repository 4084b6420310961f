/**
 * The specimen's tiles as a target: the boxes of the shown tiles, as far as they are not clipped.
 * The objects in them are targets too, so that the gaze rests on an object and not on its tile.
 */
import { Matrix4, type Object3D } from "three";
import { type Clip, WHOLE } from "../math/clip";
import { type BoxedTile, pickTile } from "../math/pick";
import type { Ray } from "../math/vec3";
import type { ViewerState } from "../state/viewer_state";
import type { Hit, SceneRay, Target } from "./ray_pointer";
import { rayAlong } from "./rays";

export const TILE = "tile:";
const OF = "/";

export class TileTarget implements Target {
  readonly isOnTop = false;
  private names = "";
  private shown: readonly BoxedTile[] = [];
  private clip: Clip = WHOLE;
  /**
   * The parts of the state that decide which objects are shown in the tiles, and how often they
   * have changed.
   */
  private content: readonly unknown[] = [];
  private changes = 0;
  /** While points are measured, each point of a tile is another choice. */
  private isMeasuring = false;
  private readonly toSpecimen = new Matrix4();

  /**
   * @param onChoose called with the ray in um of the specimen
   * @param objectAlong returns name and distance of the object along a ray in um, or null
   */
  constructor(
    private readonly specimen: Object3D,
    private readonly onChoose: (ray: Ray, tile: string, isByGaze: boolean) => void,
    private readonly objectAlong: (
      ray: Ray,
    ) => Readonly<{ id: string; distance: number }> | null = () => null,
  ) {}

  set tiles(tiles: readonly BoxedTile[]) {
    if (tiles === this.shown) return;
    this.shown = tiles;
    this.names = tiles.map(({ id }) => id).join();
  }

  /** Takes over which objects are shown and which part of the specimen is clipped. */
  sync({ objects, clip, channels, tool }: ViewerState): void {
    const content = [objects, clip, channels];
    if (content.some((each, i) => each !== this.content[i])) this.changes++;
    this.content = content;
    this.clip = clip;
    this.isMeasuring = tool === "measure";
  }

  /**
   * Changes with the shown tiles, their pose and the objects in them, since a target that moves
   * under a resting gaze was not looked for.
   */
  get layout(): string {
    return `tiles ${this.names} ${this.changes} ${placeText(this.specimen.matrixWorld)}`;
  }

  intersect(ray: SceneRay): Hit | null {
    this.toSpecimen.copy(this.specimen.matrixWorld).invert();
    const inside = rayAlong(ray, this.toSpecimen);
    const tileHit = pickTile(inside, this.shown, this.clip);
    const object = tileHit && this.objectAlong(inside);
    if (tileHit === null) return null;
    const key = TILE + (object ? `${tileHit.id}${OF}${object.id}` : tileHit.id);
    // The ray's direction is one metre long, also when expressed in um.
    const { distance } = object ?? tileHit;
    return { key, place: key, distance_m: distance, isStep: true, isGradual: this.isMeasuring };
  }

  choose({ key }: Hit, ray: SceneRay, isByGaze: boolean): void {
    if (key === null) return;
    this.toSpecimen.copy(this.specimen.matrixWorld).invert();
    this.onChoose(rayAlong(ray, this.toSpecimen), key.slice(TILE.length).split(OF)[0], isByGaze);
  }
}

/** A pose as text, with five significant digits. */
export function placeText({ elements }: Matrix4): string {
  return elements.map((each) => each.toPrecision(5)).join(" ");
}
