/**
 * A user in stereo who looks, rests and presses, without a browser: with the real hands, but
 * without drawing.
 */
import { Euler, Matrix4, Quaternion, Scene, Vector3 } from "three";
import { HandleTarget } from "../../../src/annotations/handle_target";
import {
  dragHandle,
  type HandleId,
  handlesOf,
  TOLERANCE_RAD,
} from "../../../src/marks/clip_handles";
import { dragLamp, isLampHandle, lampHandles } from "../../../src/marks/lamp_handles";
import type { Box } from "../../../src/math/box";
import type { Ray } from "../../../src/math/vec3";
import type { Region } from "../../../src/panel/canvas/draw_list";
import { type PanelView, START_VIEW } from "../../../src/panel/controls";
import { XR_DISTANCE_M } from "../../../src/render/placement";
import { Specimen } from "../../../src/render/specimen_pose";
import { chosenTile } from "../../../src/state/chosen_tile";
import { initialState } from "../../../src/state/initial_state";
import { reduce } from "../../../src/state/reduce";
import type { ViewerState } from "../../../src/state/viewer_state";
import { Hands } from "../../../src/xr/interaction";
import { STEREO_FACTS } from "../fixture/facts";
import { SPECIMEN_BOX, sampleManifest } from "../fixture/manifest";
import { buildPanel, type Facts } from "../panel/whole_panel";
import { tremble } from "./tremble";

/** Longest time step of a frame, s. */
const FRAME_S = 0.1;
/** Milliseconds in which a head turns. */
const TURN_MS = 500;
const EYE = new Vector3();
const RAD = Math.PI / 180;
const SPECIMEN: Box = { min: [...SPECIMEN_BOX.min], max: [...SPECIMEN_BOX.max] };

/**
 * The two kinds of stereo are available, and a step can be undone and redone, so that every control
 * can be operated.
 */
const FACTS: Facts = {
  ...STEREO_FACTS,
  split: { isAvailable: true, reason: "" },
  undo: "Colour",
  redo: "Colour",
};

/** A WebXR session of a Cardboard, whose one button selects what the head looks at. */
class ButtonSession extends EventTarget {
  readonly inputSources = [{ targetRayMode: "gaze", profiles: ["generic-button"] }];

  press(time_ms: number): void {
    const [inputSource] = this.inputSources;
    for (const type of ["selectstart", "select", "selectend"]) {
      const event = Object.assign(new Event(type), { inputSource, frame: null });
      Object.defineProperty(event, "timeStamp", { value: time_ms });
      this.dispatchEvent(event);
    }
  }
}

export class LookingPerson {
  state: ViewerState;
  /** All requests that left the panel. */
  readonly requests: unknown[] = [];
  /**
   * Number of changes, including the pages of the panel. A change in the following frame counts as
   * the same one.
   */
  changes = 0;
  /** Returns the object that every ray hits; null: none. */
  objectAlong: () => Readonly<{ id: string; distance: number }> | null = () => null;
  readonly hands: Hands;
  /** Handles of the cut and of the lamps. */
  readonly handles = new HandleTarget(TOLERANCE_RAD.gaze, (id, ray) => this.drag(id, ray));
  /** Rays by which points were measured, um. */
  readonly measured: Ray[] = [];
  /** Time on the clock of the frames, in milliseconds. */
  now_ms = 1000;
  private readonly specimen: Specimen;
  private readonly pose: Specimen["pose"];
  private readonly tiles: ReturnType<typeof sampleManifest>["tiles"];
  private view: Partial<PanelView> = {};
  private session: ButtonSession | null = null;
  private facing = new Quaternion();
  private readonly earlier = new Quaternion();
  private before: readonly unknown[] = [];
  private hasJustChanged = false;
  private readonly offsets = tremble(FRAME_S);

  constructor(channels = 12, change: (state: ViewerState) => ViewerState = (state) => state) {
    const manifest = sampleManifest(channels);
    this.state = change(initialState(manifest));
    const specimen = new Specimen(manifest.specimen.bounds_um);
    specimen.anchorAt(new Vector3(0, 0, -XR_DISTANCE_M));
    this.specimen = specimen;
    this.pose = specimen.pose;
    this.tiles = manifest.tiles;
    this.hands = new Hands({
      xr: { getFrame: () => null as unknown as XRFrame, getReferenceSpace: () => null },
      scene: new Scene(),
      specimen,
      tiles: manifest.tiles,
      handles: () => [this.handles],
      objectAlong: () => this.objectAlong(),
      isPainted: false,
      now_ms: () => this.now_ms,
      buildPanel: (view) => buildPanel(this.state, FACTS, view),
      onAction: (action) => {
        this.requests.push(action);
        this.state = reduce(this.state, action);
      },
      onCommand: (command) => {
        this.requests.push(command);
        this.hands.run(command, this.state);
      },
      onChoose: (ray, tile) => {
        if (this.state.tool === "measure") {
          this.measured.push(ray);
          return;
        }
        this.requests.push(tile);
        this.state = reduce(this.state, chosenTile(this.state, tile));
      },
      onLeave: () => this.requests.push("leave"),
      onLenses: (lenses) => this.requests.push(lenses),
    });
    this.hands.start(null);
    this.frame(0);
  }

  get regions(): readonly Region[] {
    return this.hands.panel.regions;
  }

  /** Ids of all switches of the panel. */
  get switches(): readonly string[] {
    return buildPanel(this.state, FACTS, { ...START_VIEW, ...this.view })
      .sections.flatMap(({ items }) => items)
      .flatMap((item) => (item.kind === "group" ? [...item.controls, ...item.more] : [item]))
      .flatMap(({ kind, id }) => (kind === "toggle" ? [id] : []));
  }

  /** Sections of the menu. */
  get tabs(): readonly string[] {
    while (this.has("up")) this.pressOn("up");
    const found = new Set<string>();
    for (let before = -1; found.size > before; this.pressOn("more")) {
      before = found.size;
      for (const { id } of this.regions) if (id.startsWith("tab=")) found.add(id.slice(4));
    }
    return [...found];
  }

  region(id: string): Region {
    const found = this.regions.find((each) => each.id === id);
    if (found === undefined) throw new Error(`no ${id} in ${this.regions.map((each) => each.id)}`);
    return found;
  }

  /** Looks at a control of the panel, or at its button, `opener`. `across` and `down` are shares of it. */
  lookAt(id: string, across?: number, down?: number): void {
    const at = this.hands.panel.pointOf(id, across, down);
    if (at === null) throw new Error(`no ${id} in ${this.regions.map((each) => each.id)}`);
    this.faceTo(at);
  }

  lookUp(): void {
    this.earlier.copy(this.facing);
    this.turnTo(0, 60);
  }

  /** Turns the gaze to the right, at the same height. */
  lookAside(): void {
    this.turnBy(20);
  }

  /** Looks at the middle of a tile's front face. */
  lookAtTile(name: string): void {
    const tile = this.tiles.find(({ id }) => `tile:${id}` === name);
    if (tile === undefined) throw new Error(`no ${name}`);
    const { min, max } = tile.bounds_um;
    const front = new Vector3((min[0] + max[0]) / 2, (min[1] + max[1]) / 2, max[2]);
    this.faceTo(front.applyMatrix4(this.specimen.group.matrixWorld));
  }

  /** Looks at the middle of a handle. */
  lookAtHandle(id: HandleId): void {
    const handle = this.handles.handles.find((each) => each.id === id);
    if (handle === undefined) throw new Error(`no ${id}`);
    this.faceTo(new Vector3(...handle.position).applyMatrix4(this.specimen.group.matrixWorld));
  }

  /** Looks in the direction before `lookUp`. */
  lookBack(): void {
    this.facing.copy(this.earlier);
    this.now_ms += TURN_MS;
    this.frame(0);
  }

  /** Place and rotation of the specimen. */
  get place(): string {
    const { position, orientation, scale } = this.specimen.pose;
    return JSON.stringify([position.toArray(), orientation.toArray(), scale]);
  }

  /** Whether the gaze carries something. */
  get isCarrying(): boolean {
    return this.hands.isCarrying;
  }

  /** Turns to the right of the present direction, degrees. */
  turnBy(yaw_deg: number): void {
    const { x, y } = new Euler().setFromQuaternion(this.facing, "YXZ");
    this.turnTo(y / RAD - yaw_deg, x / RAD);
  }

  private drag(id: HandleId, ray: Ray): void {
    const drag = isLampHandle(id)
      ? (dragLamp(id, ray, this.state, SPECIMEN, false)?.action ?? null)
      : dragHandle(id, ray, this.state.clip, SPECIMEN);
    if (drag !== null) this.state = reduce(this.state, drag);
  }

  private turnTo(yaw_deg: number, pitch_deg: number): void {
    this.facing.setFromEuler(new Euler(pitch_deg * RAD, yaw_deg * RAD, 0, "YXZ"));
    this.now_ms += TURN_MS;
    this.frame(0);
  }

  private faceTo(at: Vector3): void {
    this.facing.setFromRotationMatrix(new Matrix4().lookAt(EYE, at, new Vector3(0, 1, 0)));
    this.now_ms += TURN_MS;
    this.frame(0);
  }

  /** Keeps looking at the same place, with the tremble of a head. */
  rest(seconds: number): void {
    for (let k = 0; k < Math.round(seconds / FRAME_S); k++) this.frame(FRAME_S);
  }

  /** Continues in a WebXR session, whose events report the button. */
  enterSession(): void {
    this.session = new ButtonSession();
    this.hands.start(this.session as unknown as XRSession);
    this.frame(0);
  }

  /** Presses the Cardboard's button after a time. */
  press(after_ms = 0): void {
    this.now_ms += after_ms;
    if (this.session === null) this.hands.tap();
    else this.session.press(this.now_ms);
    this.frame(0);
  }

  /** Opens a section of the panel, or a group of it (`channels/c2`), and one of its pages. */
  open(where: string, page = 0, view: Partial<PanelView> = {}): void {
    const [tab, group] = where.split("/");
    this.view = view;
    this.hands.panel.take(view);
    if (!this.hands.panel.isOpen) this.hands.panel.toggle();
    this.frame(0);
    while (this.has("up")) this.pressOn("up");
    while (!this.has(`tab=${tab}`)) this.pressOn("more");
    this.pressOn(`tab=${tab}`);
    if (group !== undefined) this.openGroup(group);
    for (let k = 0; k < page; k++) this.pressOn("more");
    this.lookUp();
    this.frame(FRAME_S);
    this.requests.length = 0;
    this.changes = 0;
  }

  /** Returns whether the menu or the bar has a target. */
  has(id: string): boolean {
    return this.hands.panel.places.some((each) => each.id === id);
  }

  /** Returns the first target of the menu or the bar whose name has a beginning. */
  find(start: string): string {
    const found = this.hands.panel.places.find(({ id }) => id.startsWith(start));
    if (found === undefined) throw new Error(`no ${start}`);
    return found.id;
  }

  /** Whether the specimen has been moved or rotated. */
  get hasMoved(): boolean {
    const [{ position, orientation }, then] = [this.specimen.pose, this.pose];
    return !position.equals(then.position) || !orientation.equals(then.orientation);
  }

  private openGroup(group: string): void {
    while (!this.has(`${group}/open`)) this.pressOn("more");
    this.pressOn(`${group}/open`);
    this.pressOn(`${group}/more`);
  }

  private pressOn(id: string): void {
    this.lookAt(id);
    this.press();
    this.frame(0);
  }

  dispose(): void {
    this.hands.dispose();
  }

  private frame(dt_s: number): void {
    this.now_ms += 1000 * dt_s;
    const { clip } = this.state;
    this.handles.handles = [...handlesOf(clip, SPECIMEN), ...lampHandles(this.state, SPECIMEN)];
    this.handles.specimen = this.specimen.group.matrixWorld;
    const [right_deg, up_deg] = this.offsets.next().value as readonly [number, number];
    const offset = new Quaternion().setFromEuler(new Euler(up_deg * RAD, -right_deg * RAD, 0));
    const head = new Matrix4().makeRotationFromQuaternion(this.facing.clone().multiply(offset));
    this.hands.update(dt_s, head, this.state);
    this.note();
  }

  private note(): void {
    const { isOpen, quad } = this.hands.panel;
    const now = [this.state, isOpen, quad.paints, this.requests.length];
    const hasChanged = now.some((each, i) => each !== this.before[i]);
    this.before = now;
    if (hasChanged && !this.hasJustChanged) this.changes++;
    this.hasJustChanged = hasChanged;
  }
}

/** Returns the sections of the panel, with the targets of each page. */
export function pagesOf(
  view: Partial<PanelView>,
  change?: (state: ViewerState) => ViewerState,
): readonly (readonly [tab: string, page: number, ids: readonly string[]])[] {
  const person = new LookingPerson(12, change);
  person.open("channels", 0, view);
  const tabs = person.tabs;
  const pages = [...tabs, "channels/c2"].flatMap((tab) => {
    person.open(tab, 0, view);
    const found: (readonly [string, number, readonly string[]])[] = [];
    const seen = new Set<string>();
    for (let page = 0; ; page++) {
      const ids = person.regions.map(({ id }) => id);
      if (seen.has(ids.join())) return found;
      seen.add(ids.join());
      found.push([tab, page, page === 0 && tab === tabs[0] ? ids : ids.filter(isOfThePage)]);
      if (!ids.includes("more")) return found;
      person.lookAt("more");
      person.press();
      person.lookUp();
    }
  });
  person.dispose();
  return pages;
}

/** The buttons of the bar are the same on every page. */
const isOfThePage = (id: string) => !["leave", "close", "up"].includes(id);
