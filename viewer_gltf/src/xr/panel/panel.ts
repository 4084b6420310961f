/**
 * The panel in the room: one page of the layout at a time on a quad, and the bar below the specimen, which is
 * always there and opens it.
 */
import { Group, type Matrix4, Vector3 } from "three";
import type { RoomRay, Target } from "../../interaction/ray_pointer";
import { BAR_HEIGHT, BAR_WIDTH, barOf } from "../../panel/canvas/bar";
import type { CanvasChange, CanvasRequest, Region } from "../../panel/canvas/draw_list";
import { CONTENT, HEIGHT, type Page, pageOf, WIDTH } from "../../panel/canvas/page";
import { keepPlaces } from "../../panel/channel_cards";
import {
  changePanel,
  type Layout,
  type Lenses,
  type PanelView,
  START_VIEW,
} from "../../panel/controls";
import type { Action } from "../../state/actions";
import type { Command } from "../../state/commands";
import { START_VOLUMES } from "../../state/parameters/volumes";
import type { ViewerState } from "../../state/viewer_state";
import { CanvasQuad, type Spot } from "./canvas_quad";
import { PanelPages } from "./panel_pages";
import { PANEL, PanelSurface, type PlacedTarget } from "./panel_surface";
import {
  type Bearing,
  barPitch,
  bearingOf,
  followHead,
  headBearing,
  panelBearing,
  panelDistance_m,
  pointAt,
  type Setting,
} from "./placement";

/** Time between readings of values outside the state (frame time, gazed tile), s. */
const REFRESH_S = 0.5;
export type RoomPanelOptions = Readonly<{
  buildPanel: (view: PanelView) => Layout;
  onWish: (wish: Action | Command) => void;
  onLeave: () => void;
  /** The phone is in a viewer of other lenses. */
  onLenses: (lenses: Lenses) => void;
  /** Reports why a request can't be granted. */
  onAnnounce: (text: string) => void;
  /** The last choice is undone. */
  onUndo: () => void;
  /** The specimen is taken hold of by the gaze along a ray; then it is carried along others. */
  onCarry: (ray: RoomRay, isStart: boolean) => void;
  /** Absent: true. False: nothing is painted, as in a test without a browser. */
  isPainted?: boolean;
}>;

export class RoomPanel {
  readonly group = new Group();
  readonly quad: CanvasQuad;
  private readonly menu: PanelSurface;
  private readonly bar: PanelSurface;
  private page: Page | null = null;
  private view: PanelView = START_VIEW;
  private readonly pages = new PanelPages(() => this.giveCards());
  private state: ViewerState | null = null;
  private isStale = true;
  private rested_s = 0;
  /** null until the first frame gives the head's direction. */
  private barYaw: number | null = null;
  /** It opens with the next frame, which knows where the eye is: over the bar, or where the head faces. */
  private wantsPlace: "bar" | "head" | null = null;
  /** The last request: a button that is held still asks for nothing more. */
  private dragged = "";
  private lastMode = START_VOLUMES.mode;
  /** Whether the last choice can be undone by the bar. */
  canUndo = false;
  /** The specimen is carried: the bar would be in the way. */
  isCarrying = false;

  constructor(private readonly options: RoomPanelOptions) {
    const context = options.isPainted === false ? null : undefined;
    const choose = (region: Region, spot: Spot, ray: RoomRay, isPress: boolean) =>
      this.choose(region, spot, ray, isPress);
    const freshen = () => {
      if (this.isStale && this.state !== null) this.refresh(this.state);
    };
    this.quad = new CanvasQuad(WIDTH, HEIGHT, context);
    this.menu = new PanelSurface("menu", this.quad, choose, freshen);
    this.bar = new PanelSurface(
      "bar",
      new CanvasQuad(BAR_WIDTH, BAR_HEIGHT, context),
      choose,
      freshen,
    );
    this.group.name = "panel";
    this.group.visible = false;
    this.group.add(this.menu.quad.mesh, this.bar.quad.mesh);
  }

  /** In the order in which rays meet them. */
  get targets(): readonly Target[] {
    return [this.menu, this.bar];
  }

  /** The page's own panel has chosen it, and this one shows it. */
  take(view: Partial<PanelView>): void {
    this.view = { ...this.view, ...view };
    this.isStale = true;
  }

  get isOpen(): boolean {
    return this.quad.mesh.visible;
  }

  /** The middle of the upper edge of the open menu's rows in the room; null: the menu is closed. */
  get upperEdge(): Vector3 | null {
    return this.isOpen ? this.quad.pointOf(CONTENT, 0.5, 0) : null;
  }

  /** The regions of the menu to point at now, for tests and for a program that reads them aloud. */
  get regions(): readonly Region[] {
    return this.isOpen ? [...this.menu.shown.regions, ...this.bar.shown.regions] : [];
  }

  /** What the specimen stands before. */
  setting: Setting = "before-eyes";

  /** Stereo has begun, or has ended. */
  setShown(isShown: boolean): void {
    this.group.visible = isShown;
    this.barYaw = null;
    this.canUndo = this.isCarrying = false;
    if (!isShown) this.close();
  }

  close(): void {
    this.quad.mesh.visible = false;
    this.isStale = true;
  }

  toggle(): void {
    if (this.isOpen) this.close();
    else this.wantsPlace = "head";
  }

  /** Whether it looks otherwise than before. */
  update(dt_s: number, head: Matrix4, state: ViewerState): boolean {
    const eye = new Vector3().setFromMatrixPosition(head);
    const bearing = headBearing(head);
    const { setting } = this;
    this.barYaw = followHead(this.barYaw ?? bearing.yaw, bearing, dt_s, setting);
    let isChanged = false;
    if (this.wantsPlace !== null) {
      const { pitch, yaw } = panelBearing(bearing, this.barYaw, setting);
      this.open(eye, { pitch, yaw: this.wantsPlace === "bar" ? this.barYaw : yaw });
      this.wantsPlace = null;
      isChanged = true;
    }
    // the bar hangs under the panel while that is open
    if (this.isOpen) this.barYaw = bearingOf(this.quad.mesh.position.clone().sub(eye)).yaw;
    const under: Bearing = { yaw: this.barYaw, pitch: barPitch(setting, this.isOpen) };
    this.bar.quad.place(pointAt(under, eye, panelDistance_m(setting)), eye);
    this.bar.quad.mesh.visible = !this.isCarrying;
    this.rested_s += dt_s;
    if (this.pages.advance(dt_s)) this.isStale = true;
    if (state !== this.state || this.rested_s >= REFRESH_S) this.isStale = true;
    if (this.isOpen) this.view = keepPlaces(this.view, state);
    this.state = state;
    if (state.mode !== "off") this.lastMode = state.mode;
    const isMenuNew = this.isStale && this.refresh(state);
    const isBarNew = this.bar.show(
      barOf({ state, page: this.page, canUndo: this.canUndo, lastMode: this.lastMode }),
    );
    return isMenuNew || isBarNew || isChanged;
  }

  /** Light up what is pointed at. */
  light(key: string | null): void {
    const id = key?.startsWith(PANEL) ? key.slice(PANEL.length) : null;
    this.pages.fan.point(id);
    for (const surface of [this.menu, this.bar]) surface.light(id);
  }

  /** The bar and what the panel has now, each with a point of it in the room: of a slider at 0.3 of it. */
  get places(): readonly PlacedTarget[] {
    if (!this.group.visible) return []; // a flat screen
    return [...(this.isOpen ? this.menu.places : []), ...this.bar.places];
  }

  /** What was ahead is another way of the room now: the panel stays where it is to the head. */
  comeAlong(from: Matrix4, to: Matrix4): void {
    this.barYaw = null;
    const { position } = this.quad.mesh;
    position.applyMatrix4(from.clone().invert()).applyMatrix4(to);
    this.quad.place(position, new Vector3().setFromMatrixPosition(to));
  }

  /** Where the middle of a region is in the room; for tests. */
  pointOf(id: string, across = 0.5, down = 0.5): Vector3 | null {
    return this.menu.pointOf(id, across, down) ?? this.bar.pointOf(id, across, down);
  }

  dispose(): void {
    this.menu.quad.dispose();
    this.bar.quad.dispose();
  }

  private open(eye: Vector3, bearing: Bearing): void {
    this.quad.place(pointAt(bearing, eye, panelDistance_m(this.setting)), eye);
    this.quad.mesh.visible = true;
    this.pages.begin();
  }

  /** The page that is opened has cards for the channels that are shown now. */
  private giveCards(): void {
    this.view = { ...this.view, channelsWithCard: null };
    this.isStale = true;
  }

  private refresh(state: ViewerState): boolean {
    this.isStale = false;
    this.rested_s = 0;
    if (!this.isOpen) {
      this.page = null;
      return false;
    }
    this.view = keepPlaces(this.view, state);
    this.page = pageOf(this.options.buildPanel(this.view), this.pages.view);
    return this.menu.show(this.page);
  }

  /** Beyond a region's ends is at its ends: a slider is dragged past them. */
  private choose(region: Region, spot: Spot, ray: RoomRay, isPress: boolean): void {
    if (region.isCarry) {
      this.options.onCarry(ray, isPress);
      return;
    }
    const { x, y, width, height } = region.rect;
    const inside = (share: number) => Math.min(1, Math.max(0, share));
    const at = [inside((spot.x - x) / width), inside((spot.y - y) / height)] as const;
    const wish = isPress && region.press !== undefined ? region.press(...at) : region.to(...at);
    const words = JSON.stringify(wish);
    if (wish === null || (!isPress && words === this.dragged)) return;
    this.dragged = words;
    this.isStale = true;
    this.grant(wish);
  }

  private grant(wish: CanvasRequest): void {
    const { options } = this;
    if (typeof wish === "string") options.onWish(wish);
    else if ("panel" in wish) {
      this.view = changePanel(this.view, wish);
      if (wish.panel === "lenses") options.onLenses(wish.lenses);
    } else if ("type" in wish) options.onWish(wish);
    else this.act(wish);
  }

  private act(wish: CanvasChange): void {
    const { options } = this;
    if (wish.canvas === "group") this.take({ picked: wish.group });
    if (this.pages.follow(wish)) return;
    switch (wish.canvas) {
      case "open":
        this.wantsPlace = "bar";
        break;
      case "announce":
        options.onAnnounce(wish.text);
        break;
      case "undo":
        options.onUndo();
        break;
      case "close":
        this.close();
        break;
      case "leave":
        options.onLeave();
        break;
      case "carry":
        break; // see choose
    }
  }
}
