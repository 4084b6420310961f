/**
 * The headset panel: a quad that shows one page of the panel at a time, and the bar below the
 * specimen, which is always there and opens the panel.
 */
import { Group, type Matrix4, Vector3 } from "three";
import type { SceneRay, Target } from "../../interaction/ray_pointer";
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

/**
 * Seconds between readings of values outside the state, such as the frame time and the gazed tile.
 */
const REFRESH_S = 0.5;
export type HeadsetPanelOptions = Readonly<{
  buildPanel: (view: PanelView) => Layout;
  onRequest: (request: Action | Command) => void;
  onLeave: () => void;
  onLenses: (lenses: Lenses) => void;
  /** Called with the reason why a request can't be carried out. */
  onAnnounce: (text: string) => void;
  onUndo: () => void;
  /**
   * Called when the gaze picks up the specimen along a ray, and then with each ray that carries it.
   */
  onCarry: (ray: SceneRay, isStart: boolean) => void;
  /** False: nothing is painted, as in a test without a browser. Absent: true. */
  isPainted?: boolean;
}>;

export class HeadsetPanel {
  readonly group = new Group();
  readonly quad: CanvasQuad;
  private readonly menu: PanelSurface;
  private readonly bar: PanelSurface;
  private page: Page | null = null;
  private view: PanelView = START_VIEW;
  private readonly pages = new PanelPages(() => this.resetCards());
  private state: ViewerState | null = null;
  private isStale = true;
  private rested_s = 0;
  /** Heading of the bar, radians; null until the first frame gives the head's direction. */
  private barYaw: number | null = null;
  /**
   * Set until the next frame opens the panel, which knows the eye: above the bar, or where the head
   * faces.
   */
  private wantsPlace: "bar" | "head" | null = null;
  /** The last request as JSON, so that a held button does not repeat it. */
  private dragged = "";
  private lastMode = START_VOLUMES.mode;
  canUndo = false;
  /** True while the specimen is carried, which hides the bar. */
  isCarrying = false;

  constructor(private readonly options: HeadsetPanelOptions) {
    const context = options.isPainted === false ? null : undefined;
    const choose = (region: Region, spot: Spot, ray: SceneRay, isPress: boolean) =>
      this.choose(region, spot, ray, isPress);
    const refreshIfStale = () => {
      if (this.isStale && this.state !== null) this.refresh(this.state);
    };
    this.quad = new CanvasQuad(WIDTH, HEIGHT, context);
    this.menu = new PanelSurface("menu", this.quad, choose, refreshIfStale);
    this.bar = new PanelSurface(
      "bar",
      new CanvasQuad(BAR_WIDTH, BAR_HEIGHT, context),
      choose,
      refreshIfStale,
    );
    this.group.name = "panel";
    this.group.visible = false;
    this.group.add(this.menu.quad.mesh, this.bar.quad.mesh);
  }

  /** The targets in the order in which rays are tested. */
  get targets(): readonly Target[] {
    return [this.menu, this.bar];
  }

  /** Takes over a change of view that was made in the page's panel. */
  take(view: Partial<PanelView>): void {
    this.view = { ...this.view, ...view };
    this.isStale = true;
  }

  get isOpen(): boolean {
    return this.quad.mesh.visible;
  }

  /** Middle of the upper edge of the open menu's rows in the scene; null if the menu is closed. */
  get upperEdge(): Vector3 | null {
    return this.isOpen ? this.quad.pointOf(CONTENT, 0.5, 0) : null;
  }

  /** The regions that can be pointed at now, for tests and for programs that read them aloud. */
  get regions(): readonly Region[] {
    return this.isOpen ? [...this.menu.shown.regions, ...this.bar.shown.regions] : [];
  }

  /** The surroundings of the specimen. */
  setting: Setting = "before-eyes";

  /** Shows the bar when stereo begins, hides everything when it ends. */
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

  /** Updates the panel for one frame. Returns whether it looks different from the last frame. */
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
    // the bar hangs below the open panel
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

  light(key: string | null): void {
    const id = key?.startsWith(PANEL) ? key.slice(PANEL.length) : null;
    this.pages.fan.point(id);
    for (const surface of [this.menu, this.bar]) surface.light(id);
  }

  /**
   * The controls of bar and panel, each with a point on it in the scene; on a slider at 0.3 of its
   * width.
   */
  get places(): readonly PlacedTarget[] {
    if (!this.group.visible) return []; // the panel is not shown on a flat screen
    return [...(this.isOpen ? this.menu.places : []), ...this.bar.places];
  }

  /** Keeps the panel in place relative to the head after the direction ahead has changed. */
  keepPlace(from: Matrix4, to: Matrix4): void {
    this.barYaw = null;
    const { position } = this.quad.mesh;
    position.applyMatrix4(from.clone().invert()).applyMatrix4(to);
    this.quad.place(position, new Vector3().setFromMatrixPosition(to));
  }

  /** A point of a region in the scene, by default its middle; for tests. */
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

  /** Gives cards to the channels that are shown now, when another page is opened. */
  private resetCards(): void {
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

  /**
   * Carries out the request of a region at a spot. Spots beyond the region count as its edge, since
   * sliders are dragged past their ends.
   */
  private choose(region: Region, spot: Spot, ray: SceneRay, isPress: boolean): void {
    if (region.isCarry) {
      this.options.onCarry(ray, isPress);
      return;
    }
    const { x, y, width, height } = region.rect;
    const inside = (share: number) => Math.min(1, Math.max(0, share));
    const at = [inside((spot.x - x) / width), inside((spot.y - y) / height)] as const;
    const request = isPress && region.press !== undefined ? region.press(...at) : region.to(...at);
    const json = JSON.stringify(request);
    if (request === null || (!isPress && json === this.dragged)) return;
    this.dragged = json;
    this.isStale = true;
    this.carryOut(request);
  }

  private carryOut(request: CanvasRequest): void {
    const { options } = this;
    if (typeof request === "string") options.onRequest(request);
    else if ("panel" in request) {
      this.view = changePanel(this.view, request);
      if (request.panel === "lenses") options.onLenses(request.lenses);
    } else if ("type" in request) options.onRequest(request);
    else this.change(request);
  }

  private change(change: CanvasChange): void {
    const { options } = this;
    if (change.canvas === "group") this.take({ picked: change.group });
    if (this.pages.follow(change)) return;
    switch (change.canvas) {
      case "open":
        this.wantsPlace = "bar";
        break;
      case "announce":
        options.onAnnounce(change.text);
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
        break; // handled in `choose`
    }
  }
}
