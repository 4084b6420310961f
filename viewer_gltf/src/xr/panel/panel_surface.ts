/** A quad of the panel in the room with targets on it: the page, or the bar. */
import type { Vector3 } from "three";
import type { Hit, RoomRay, Target } from "../../interaction/ray_pointer";
import { holds, type Mark, type Region } from "../../panel/canvas/draw_list";
import type { CanvasQuad, Spot } from "./canvas_quad";

/** Over a specimen that is brought nearer than the panel, by which it is brought; under a notice. */
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
  /** The places of the targets, and the number of times that they have changed. */
  private arrangement = "";
  private changes = 0;

  constructor(
    private readonly name: string,
    readonly quad: CanvasQuad,
    private readonly onChoose: (region: Region, spot: Spot, ray: RoomRay, isPress: boolean) => void,
    /** Lays the targets out again, if a choice has changed them. */
    private readonly freshen: () => void,
  ) {
    quad.drawOver(RENDER_ORDER);
  }

  /** Changes whenever a target appears, disappears or moves. */
  get layout(): string {
    return `${this.name} ${this.quad.mesh.visible} ${this.changes}`;
  }

  /** Whether it looks otherwise than before. */
  show(shown: Shown): boolean {
    this.shown = shown;
    const arrangement = shown.regions.map((each) => `${each.id} ${placeOf(each)}`).join("\n");
    if (arrangement !== this.arrangement) this.changes++;
    this.arrangement = arrangement;
    return this.quad.show(shown.marks);
  }

  /** Light up what is pointed at. */
  light(id: string | null): void {
    this.quad.light(this.shown.regions.find((region) => region.id === id)?.rect ?? null);
  }

  /** Its targets, each with a point of it in the room: of a slider at 0.3 of its width. */
  get places(): readonly PlacedTarget[] {
    return this.shown.regions.flatMap(({ id, label, isSlide }) => {
      const at = this.pointOf(id, isSlide ? 0.3 : 0.5, 0.5);
      return at === null ? [] : [{ id, label, at }];
    });
  }

  /** A point of a region in the room, by shares of its width and height; null: the region is not shown. */
  pointOf(id: string, across: number, down: number): Vector3 | null {
    const region = this.shown.regions.find((each) => each.id === id);
    if (region === undefined || !this.quad.mesh.visible) return null;
    return this.quad.pointOf(region.rect, across, down);
  }

  meet(ray: RoomRay): Hit | null {
    const spot = this.quad.meet(ray);
    if (spot === null) return null;
    const region = this.shown.regions.find(({ rect }) => holds(rect, spot));
    const { distance_m } = spot;
    if (region === undefined) return { key: null, distance_m };
    const { id, repeats, isStep, isCarry, isGlance } = region;
    const hit: Hit = { key: PANEL + id, distance_m, place: placeOf(region), isStep, isGlance };
    if (repeats !== undefined) return { ...hit, repeats, isStep: true };
    if (isCarry) return { ...hit, hold: "carry" };
    if (!region.isSlide) return hit;
    // what is first taken hold of can be carried by the gaze alone
    return { ...hit, hold: region.press === undefined ? "slide" : "carry" };
  }

  choose({ key }: Hit, ray: RoomRay): void {
    if (key !== null) this.grant(key, ray, true);
  }

  drag(key: string, ray: RoomRay): void {
    this.freshen(); // what was taken hold of is part of it by now
    this.grant(key, ray, false);
  }

  private grant(key: string, ray: RoomRay, isPress: boolean): void {
    const region = this.shown.regions.find(({ id }) => PANEL + id === key);
    const spot = this.quad.meet(ray);
    if (region === undefined || (spot === null && !region.isCarry)) return;
    this.onChoose(region, spot ?? { x: 0, y: 0, distance_m: 0 }, ray, isPress);
  }
}
