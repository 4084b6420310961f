/**
 * The panel in the room: a quad with one section of the layout at a time, and a button under all
 * that is looked at, which opens and closes it. It opens in that button's place, straight below the gaze.
 */
import { Group, type Matrix4, Vector3 } from "three";
import type { Hit, RoomRay, Target } from "../../interaction/ray_pointer";
import { type CanvasWish, holds, type Rect, type Region, text } from "../../panel/canvas/draw_list";
import {
  type CanvasView,
  HEIGHT,
  type Page,
  PX_PER_M,
  pageOf,
  START_CANVAS,
  WIDTH,
} from "../../panel/canvas/page";
import {
  changePanel,
  type Layout,
  type Lenses,
  type PanelView,
  START_VIEW,
} from "../../panel/controls";
import { keepPlaces } from "../../panel/sections/channels";
import type { Action } from "../../state/actions";
import type { Command } from "../../state/commands";
import type { ViewerState } from "../../state/viewer_state";
import { CanvasQuad, type Spot } from "./canvas_quad";
import {
  type Bearing,
  followHead,
  headBearing,
  openerPitch,
  panelBearing,
  pointAt,
} from "./placement";

const DISTANCE_M = 1.2;
/** Over a specimen that is brought nearer than the panel, by which it is brought; under a notice. */
const RENDER_ORDER = 1800;
const OPENER_M = 0.7;
const OPENER: Rect = { x: 0, y: 0, width: 208, height: 80 };
/** Time between readings of values outside the state (frame time, gazed tile), s. */
const REFRESH_S = 0.5;

export const PANEL = "panel:";
const OPENER_KEY = "opener";

export type RoomPanelOptions = Readonly<{
  layOut: (view: PanelView) => Layout;
  onWish: (wish: Action | Command) => void;
  onLeave: () => void;
  /** The phone is in a viewer of other lenses. */
  onLenses: (lenses: Lenses) => void;
  /** Reports why a request can't be granted. */
  onAnnounce: (text: string) => void;
  /** Absent: true. False: nothing is painted, as in a test without a browser. */
  isPainted?: boolean;
}>;

function placeOf({ rect: { x, y, width, height } }: Region): string {
  return `${x} ${y} ${width} ${height}`;
}

export class RoomPanel {
  readonly group = new Group();
  readonly quad: CanvasQuad;
  private readonly opener: CanvasQuad;
  /** In the order in which rays meet them. */
  readonly targets: readonly Target[];
  private page: Page = { marks: [], regions: [] };
  /** The places of the page's controls, and the number of times that they have changed. */
  private arrangement = "";
  private changes = 0;
  private view: PanelView = START_VIEW;
  private section: CanvasView = START_CANVAS;
  private state: ViewerState | null = null;
  private isStale = true;
  private rested_s = 0;
  /** null until the first frame gives the head's direction. */
  private openerYaw: number | null = null;
  /** It opens with the next frame, which knows where the eye is. */
  private wantsPlace = false;
  /** The last request: a button that is held still asks for nothing more. */
  private dragged = "";

  constructor(private readonly options: RoomPanelOptions) {
    const context = options.isPainted === false ? null : undefined;
    this.quad = new CanvasQuad(WIDTH, HEIGHT, context);
    this.opener = new CanvasQuad(OPENER.width, OPENER.height, context);
    this.group.name = "panel";
    this.group.visible = false;
    this.group.add(this.quad.mesh, this.opener.mesh);
    this.opener.mesh.visible = true;
    for (const quad of [this.quad, this.opener]) quad.drawOver(RENDER_ORDER);
    const layout = () => this.layout;
    this.targets = [
      {
        isOnTop: true,
        get layout() {
          return layout();
        },
        meet: (ray) => this.meet(ray),
        choose: (hit, ray) => this.choose(hit, ray),
        drag: (key, ray) => this.drag(key, ray),
      },
      {
        isOnTop: true,
        meet: (ray) => this.meetOpener(ray),
        choose: () => this.toggle(),
      },
    ];
    this.paintOpener();
  }

  /** What the page's own panel has chosen, and this one shows. */
  take(view: Partial<PanelView>): void {
    this.view = { ...this.view, ...view };
    this.isStale = true;
  }

  get isOpen(): boolean {
    return this.quad.mesh.visible;
  }

  /** Changes whenever a control appears, disappears or moves. */
  private get layout(): string {
    return `panel ${this.isOpen} ${this.changes}`;
  }

  /** The regions to point at now, for tests and for a program that reads them aloud. */
  get regions(): readonly Region[] {
    return this.isOpen ? this.page.regions : [];
  }

  /** The specimen stands on a table: where the button hangs else it would be before it. */
  isTableBelow = false;
  /** And the panel, too. A screen in a hand shows the table alone: there it has to be before it. */
  isOverTable = false;

  /** Stereo has begun, or has ended. */
  setShown(isShown: boolean): void {
    this.group.visible = isShown;
    this.openerYaw = null;
    if (!isShown) this.close();
  }

  close(): void {
    this.quad.mesh.visible = false;
    this.paintOpener();
  }

  toggle(): void {
    if (this.isOpen) this.close();
    else this.wantsPlace = true;
  }

  /** Whether it looks otherwise than before. */
  update(dt_s: number, head: Matrix4, state: ViewerState): boolean {
    const eye = new Vector3().setFromMatrixPosition(head);
    const bearing = headBearing(head);
    this.openerYaw = followHead(this.openerYaw ?? bearing.yaw, bearing, dt_s);
    const at = pointAt(
      { yaw: this.openerYaw, pitch: openerPitch(this.isOpen || this.isTableBelow) },
      eye,
      OPENER_M,
    );
    this.opener.place(at, eye);
    let isChanged = false;
    if (this.wantsPlace) {
      this.wantsPlace = false;
      this.open(eye, panelBearing(bearing, this.openerYaw, this.isOverTable));
      isChanged = true;
    }
    if (!this.isOpen) return isChanged;
    this.rested_s += dt_s;
    if (state !== this.state || this.rested_s >= REFRESH_S) this.isStale = true;
    this.view = keepPlaces(this.view, state);
    this.state = state;
    if (!this.isStale) return isChanged;
    return this.refresh() || isChanged;
  }

  /** Light up what is pointed at. */
  light(key: string | null): void {
    const id = key?.startsWith(PANEL) ? key.slice(PANEL.length) : null;
    this.quad.light(this.page.regions.find((region) => region.id === id)?.rect ?? null);
    this.opener.light(key === OPENER_KEY ? OPENER : null);
  }

  /**
   * The button and what the panel has now, each with a point of it in the room: of a slider at 0.3 of it;
   * none on a flat screen.
   */
  get places(): readonly Readonly<{ id: string; label: string; at: Vector3 }>[] {
    if (!this.group.visible) return [];
    const opener = { id: OPENER_KEY, label: this.openerLabel, isSlide: false };
    return [opener, ...this.regions].flatMap(({ id, label, isSlide }) => {
      const at = this.pointOf(id, isSlide ? 0.3 : 0.5);
      return at === null ? [] : [{ id, label, at }];
    });
  }

  /** What was ahead is another way of the room now: the panel stays where it is to the head. */
  comeAlong(from: Matrix4, to: Matrix4): void {
    this.openerYaw = null;
    const { position } = this.quad.mesh;
    position.applyMatrix4(from.clone().invert()).applyMatrix4(to);
    this.quad.place(position, new Vector3().setFromMatrixPosition(to));
  }

  /** Where the middle of a region is in the room; for tests. */
  pointOf(id: string, across = 0.5, down = 0.5): Vector3 | null {
    const region = this.regions.find((each) => each.id === id);
    if (id === OPENER_KEY) return this.opener.mesh.getWorldPosition(new Vector3());
    if (region === undefined) return null;
    const { x, y, width, height } = region.rect;
    return this.quad.mesh.localToWorld(
      new Vector3(
        (x + across * width - WIDTH / 2) / PX_PER_M,
        (HEIGHT / 2 - y - down * height) / PX_PER_M,
        0,
      ),
    );
  }

  dispose(): void {
    this.quad.dispose();
    this.opener.dispose();
  }

  private open(eye: Vector3, bearing: Bearing): void {
    this.quad.place(pointAt(bearing, eye, DISTANCE_M), eye);
    this.quad.mesh.visible = true;
    this.layOutAgain();
    this.paintOpener();
  }

  /** Lay the page out again, with cards for the channels that are shown now. */
  private layOutAgain(): void {
    this.view = { ...this.view, channelsWithCard: null };
    this.isStale = true;
  }

  private refresh(): boolean {
    this.isStale = false;
    this.rested_s = 0;
    this.page = pageOf(this.options.layOut(this.view), this.section);
    const arrangement = this.page.regions.map((each) => `${each.id} ${placeOf(each)}`).join("\n");
    if (arrangement !== this.arrangement) this.changes++;
    this.arrangement = arrangement;
    return this.quad.show(this.page.marks);
  }

  private get openerLabel(): string {
    return this.isOpen ? "Close" : "Menu";
  }

  private paintOpener(): void {
    this.opener.show([
      { kind: "box", rect: OPENER, fill: "back", stroke: "accent", radius: 0 },
      text(OPENER, this.openerLabel, { align: "center", size: 38 }),
    ]);
  }

  private regionAt(spot: Spot): Region | null {
    return this.page.regions.find(({ rect }) => holds(rect, spot)) ?? null;
  }

  private meet(ray: RoomRay): Hit | null {
    const spot = this.quad.meet(ray);
    if (spot === null) return null;
    const region = this.regionAt(spot);
    const { distance_m } = spot;
    if (region === null) return { key: null, distance_m };
    const { id, repeats, isStep } = region;
    const hit: Hit = { key: PANEL + id, distance_m, place: placeOf(region), isStep };
    if (repeats !== undefined) return { ...hit, repeats, isStep: true };
    if (!region.isSlide) return hit;
    // what is first taken hold of can be carried by the gaze alone
    return { ...hit, hold: region.press === undefined ? "slide" : "carry" };
  }

  private meetOpener(ray: RoomRay): Hit | null {
    const spot = this.opener.meet(ray);
    return spot && { key: OPENER_KEY, distance_m: spot.distance_m, place: OPENER_KEY };
  }

  private choose({ key }: Hit, ray: RoomRay): void {
    const wish = key === null ? null : this.wishAt(key, ray, true);
    if (wish === null) return;
    this.dragged = JSON.stringify(wish);
    this.grant(wish);
  }

  private drag(key: string, ray: RoomRay): void {
    if (this.isStale) this.refresh(); // what was taken hold of is part of it by now
    const wish = this.wishAt(key, ray, false);
    const text = JSON.stringify(wish);
    if (wish === null || text === this.dragged) return;
    this.dragged = text;
    this.grant(wish);
  }

  /** Beyond a region's ends is at its ends: a slider is dragged past them. */
  private wishAt(key: string, ray: RoomRay, isPress: boolean): CanvasWish | null {
    const region = this.page.regions.find(({ id }) => PANEL + id === key);
    const spot = this.quad.meet(ray);
    if (region === undefined || spot === null) return null;
    const { x, y, width, height } = region.rect;
    const inside = (share: number) => Math.min(1, Math.max(0, share));
    const at = [inside((spot.x - x) / width), inside((spot.y - y) / height)] as const;
    return isPress && region.press !== undefined ? region.press(...at) : region.to(...at);
  }

  private grant(wish: CanvasWish): void {
    this.isStale = true;
    if (typeof wish === "string") this.options.onWish(wish);
    else if ("panel" in wish) {
      this.view = changePanel(this.view, wish);
      if (wish.panel === "lenses") this.options.onLenses(wish.lenses);
    } else if ("type" in wish) this.options.onWish(wish);
    else if (wish.canvas === "tab") {
      this.section = { tab: wish.section, page: 0 };
      this.layOutAgain();
    } else if (wish.canvas === "page") this.section = { ...this.section, page: wish.page };
    else if (wish.canvas === "announce") this.options.onAnnounce(wish.text);
    else if (wish.canvas === "close") this.close();
    else this.options.onLeave();
  }
}
