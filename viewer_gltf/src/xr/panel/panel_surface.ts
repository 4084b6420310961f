/** A quad of the headset panel with targets on it: the menu, or the bar. */
import type { Vector3 } from "three";
import type { Hit, SceneRay, Target } from "../../interaction/ray_pointer";
import { holds, type Mark, type Region } from "../../panel/canvas/draw_list";
import type { CanvasQuad, Spot } from "./canvas_quad";

/**
 * Draw order: over a specimen that is nearer than the panel, since the panel moves it; under
 * notices.
 */
const RENDER_ORDER = 1800;
export const PANEL = "panel:";

export type PlacedTarget = Readonly<{ id: string; label: string; at: Vector3 }>;

type Shown = Readonly<{ marks: readonly Mark[]; regions: readonly Region[] }>;

function placeOf({ rect: { x, y, width, height } }: Region): string {
  return `${x} ${y} ${width} ${height}`;
}

export class PanelSurface implements Target {
  readonly isOnTop = true;
  shown: Shown = { marks: [], regions: [] };
  /** Ids and rects of the targets, and the number of times that they have changed. */
  private arrangement = "";
  private changes = 0;

  constructor(
    private readonly name: string,
    readonly quad: CanvasQuad,
    private readonly onChoose: (
      region: Region,
      spot: Spot,
      ray: SceneRay,
      isPress: boolean,
    ) => void,
    /** Lays out the targets again if a choice has made them out of date. */
    private readonly refreshIfStale: () => void,
  ) {
    quad.drawOver(RENDER_ORDER);
  }

  /** A key that changes whenever a target appears, disappears or moves. */
  get layout(): string {
    return `${this.name} ${this.quad.mesh.visible} ${this.changes}`;
  }

  /** Shows other marks and targets. Returns whether it looks different from before. */
  show(shown: Shown): boolean {
    this.shown = shown;
    const arrangement = shown.regions.map((each) => `${each.id} ${placeOf(each)}`).join("\n");
    if (arrangement !== this.arrangement) this.changes++;
    this.arrangement = arrangement;
    return this.quad.show(shown.marks);
  }

  light(id: string | null): void {
    this.quad.light(this.shown.regions.find((region) => region.id === id)?.rect ?? null);
  }

  /** The targets, each with a point on it in the scene; on a slider at 0.3 of its width. */
  get places(): readonly PlacedTarget[] {
    return this.shown.regions.flatMap(({ id, label, isSlide }) => {
      const at = this.pointOf(id, isSlide ? 0.3 : 0.5, 0.5);
      return at === null ? [] : [{ id, label, at }];
    });
  }

  /**
   * A point of a region in the scene, by shares of its width and height; null if the region is not
   * shown.
   */
  pointOf(id: string, across: number, down: number): Vector3 | null {
    const region = this.shown.regions.find((each) => each.id === id);
    if (region === undefined || !this.quad.mesh.visible) return null;
    return this.quad.pointOf(region.rect, across, down);
  }

  intersect(ray: SceneRay): Hit | null {
    const spot = this.quad.intersect(ray);
    if (spot === null) return null;
    const region = this.shown.regions.find(({ rect }) => holds(rect, spot));
    const { distance_m } = spot;
    if (region === undefined) return { key: null, distance_m };
    const { id, repeats, isStep, isCarry, isGlance } = region;
    const hit: Hit = { key: PANEL + id, distance_m, place: placeOf(region), isStep, isGlance };
    if (repeats !== undefined) return { ...hit, repeats, isStep: true };
    if (isCarry) return { ...hit, hold: "carry" };
    if (!region.isSlide) return hit;
    // a region that must be picked up first can also be carried by the gaze
    return { ...hit, hold: region.press === undefined ? "slide" : "carry" };
  }

  choose({ key }: Hit, ray: SceneRay): void {
    if (key !== null) this.chooseAt(key, ray, true);
  }

  drag(key: string, ray: SceneRay): void {
    this.refreshIfStale(); // the target may have been laid out again since it was picked up
    this.chooseAt(key, ray, false);
  }

  private chooseAt(key: string, ray: SceneRay, isPress: boolean): void {
    const region = this.shown.regions.find(({ id }) => PANEL + id === key);
    const spot = this.quad.intersect(ray);
    if (region === undefined || (spot === null && !region.isCarry)) return;
    this.onChoose(region, spot ?? { x: 0, y: 0, distance_m: 0 }, ray, isPress);
  }
}
