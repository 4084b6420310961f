/**
 * All that is drawn on the specimen and is no part of it: handles of the clip and of the lamps,
 * measured points, scale bar, orientation, names. And what a ray means among them.
 */
import { Object3D } from "three";
import type { Manifest } from "../bundle/generated/bundle";
import type { FlatScreen, FrameView } from "../host/part";
import {
  dragHandle,
  type HandleId,
  handlesOf,
  markedClip,
  type Pointing,
  pickHandle,
  TOLERANCE_RAD,
} from "../marks/clip_handles";
import { dragLamp, isLampHandle, lampHandles } from "../marks/lamp_handles";
import { NO_SIGHT } from "../marks/sight";
import { umPerPixelAt } from "../marks/um_per_pixel";
import type { Box } from "../math/box";
import type { Clip } from "../math/clip";
import { shownBox } from "../math/pick";
import type { Ray } from "../math/vec3";
import type { Reading } from "../probe/probe_reader";
import type { Action } from "../state/actions";
import type { ShownSurface } from "../state/on_screen";
import { tileName } from "../state/tile_name";
import type { ViewerState } from "../state/viewer_state";
import { ClipMark } from "./clip_gizmo";
import { HandleTarget } from "./handle_target";
import { type Named, NameMark } from "./hover_name";
import { LampMark } from "./lamp_gizmo";
import { MeasureMark } from "./measurement";
import { Axes, OrientationMark } from "./orientation_axes";
import { Ruler } from "./ruler";
import { ScaleBarMark } from "./scale_bar";

/** Why no point is set. */
const NOTHING_MET = "There is nothing to measure there: no surface, no volume and no slice.";
/** Largest move of a head at rest, m. */
const TREMBLE_M = 0.03;

export type MarksOptions = Readonly<{
  manifest: Manifest;
  /** Finds what rays meet, and the values at points. */
  reading: Reading;
  /** Surfaces on screen now. */
  surfaces: () => readonly ShownSurface[];
  dispatch: (action: Action) => void;
  /** Say why nothing has come of it. */
  announce: (text: string) => void;
  /** The picture differs now. */
  onChange: () => void;
}>;

export class Marks {
  /** Child of the specimen's group: um, world. */
  readonly group = new Object3D();
  readonly handles = new ClipMark();
  readonly lamps = new LampMark();
  /** The handles, for gaze and hands in stereo. */
  readonly target: HandleTarget;
  readonly measured: MeasureMark;
  readonly scaleBar = new ScaleBarMark();
  readonly orientation: OrientationMark;
  readonly name = new NameMark();
  readonly ruler = new Ruler();
  readonly axes: Axes;
  /** From where the last frame was seen. */
  private sight = NO_SIGHT;
  /** The lamp that the ray which drags it has lost over its rim. */
  private beside: HandleId | null = null;
  /** The clip that the page opens with. */
  private readonly opening: Clip;
  /** Whether somebody has pointed at the picture. */
  private isPointedAt = false;
  /** The cut when stereo began; null: there is no stereo. */
  private cutAtEntry: ViewerState["clip"] | null = null;
  /** How many surfaces are on screen. */
  private surfaces = 0;
  private isDisposed = false;

  constructor(
    private readonly options: MarksOptions,
    private state: ViewerState,
  ) {
    this.opening = state.clip;
    const { sides } = options.manifest.specimen;
    this.orientation = new OrientationMark(sides);
    this.axes = new Axes(sides);
    this.target = new HandleTarget(TOLERANCE_RAD.gaze, (id, ray) => this.drag(id, ray));
    this.measured = new MeasureMark((point) => options.reading.valuesAt(point), options.onChange);
    const { handles, lamps, measured, ruler, axes, name } = this;
    this.group.name = "marks";
    this.group.add(handles.group, lamps.group, measured.group);
    this.group.add(ruler.group, axes.group, name.group);
    this.follow(state);
  }

  /** For the stage, over the canvas. */
  get overlayElements(): readonly (HTMLElement | SVGElement)[] {
    return [this.scaleBar.root, this.orientation.root, this.name.root];
  }

  /** What the pass for the depth has to leave out. */
  get overlays(): readonly Object3D[] {
    return [this.group];
  }

  follow(state: ViewerState): void {
    this.state = state;
    this.handles.show(markedClip(state.clip, this.opening, this.isPointedAt), this.shown);
    this.lamps.show(state, this.specimen);
    const cuts = handlesOf(state.clip, this.shown);
    this.target.handles = [...cuts, ...lampHandles(state, this.specimen)];
    this.showMeasured();
    this.name.forget();
  }

  /** Before every frame, drawn or not. */
  update(view: FrameView): void {
    this.sight = view.sight;
    this.target.specimen = view.specimen;
    this.cutAtEntry = view.screen === null ? (this.cutAtEntry ?? this.state.clip) : null;
    this.target.isCutAsleep = this.cutAtEntry === this.state.clip;
    const m_per_um = view.specimen.getMaxScaleOnAxis();
    const surfaces = this.options.surfaces().length;
    if (surfaces !== this.surfaces) this.name.ask(); // they come and refine, too
    this.surfaces = surfaces;
    this.name.follow(view.gaze, TREMBLE_M / m_per_um, view.dt_s, () => this.nameOf(view.gaze));
    if (this.state.measured.length > 0) this.showMeasured(); // volumes come and refine
    if (view.screen === null) this.updateInRoom(view);
    else this.updateOnScreen(view, view.screen, m_per_um);
    this.handles.update(this.sight);
    this.lamps.update(this.sight);
    this.measured.update(this.sight);
  }

  /** For each measured point the values of the shown channels that have come, as `DAPI 1210`. */
  get values(): readonly (readonly string[])[] {
    return this.state.measured.map((_, i) =>
      this.measured
        .valuesAt(i)
        .split("\n")
        .filter((line) => line !== ""),
    );
  }

  /** Read the values of the measured points once more. */
  readAnew(): void {
    this.measured.readAnew();
  }

  /** The handle that a ray (um) means. */
  pick(ray: Ray, pointing: Pointing): HandleId | null {
    this.showHandles();
    return pickHandle(ray, this.target.handles, this.sight.zoom * TOLERANCE_RAD[pointing]);
  }

  /** Bring a handle to a ray (um). */
  drag(id: HandleId, ray: Ray): void {
    const { state } = this;
    if (!isLampHandle(id)) {
      const action = dragHandle(id, ray, state.clip, this.shown);
      if (action !== null) this.options.dispatch(action);
      return;
    }
    const drag = dragLamp(id, ray, state, this.specimen, this.beside === id);
    if (drag === null) return;
    this.beside = drag.isBeside ? id : null;
    if (drag.action !== null) this.options.dispatch(drag.action);
  }

  /** Light up what is pointed at, or held. */
  highlight(id: HandleId | null): void {
    if (!this.handles.highlight(id)) return;
    this.lamps.highlight(id);
    this.lamps.show(this.state, this.specimen);
    this.options.onChange();
  }

  /** Measure from or to what a ray (um) means: a point of the newest measurement, or of another. */
  async measure(ray: Ray): Promise<void> {
    const found = await this.options.reading.probe(ray);
    if (this.isDisposed) return;
    if (found === null) this.options.announce(NOTHING_MET);
    else this.options.dispatch({ type: "add-point", point: found.point });
  }

  /** Shows the handles of the opening cut from the first time that somebody points: see `markedClip`. */
  private showHandles(): void {
    if (this.isPointedAt) return;
    this.isPointedAt = true;
    if (this.state.clip !== this.opening) return;
    this.follow(this.state);
    this.options.onChange();
  }

  /** Box of what is shown: the specimen, or the isolated tile. */
  private get shown(): Box {
    return shownBox(this.options.manifest, this.state.isolated);
  }

  private get specimen(): Box {
    return this.options.manifest.specimen.bounds_um;
  }

  private updateInRoom({ isPanelOpen, isBarBelow }: FrameView): void {
    const { sight, shown } = this;
    this.showHandles();
    this.highlight(this.target.takeSeen());
    this.scaleBar.update(null);
    this.orientation.root.style.display = "none";
    this.ruler.update(shown, sight, isBarBelow);
    if (isPanelOpen) this.ruler.group.visible = false;
    this.axes.group.visible = !isPanelOpen;
    this.axes.update(shown, sight);
    this.name.placeInRoom(sight);
  }

  private updateOnScreen(
    { head, specimen }: FrameView,
    screen: FlatScreen,
    m_per_um: number,
  ): void {
    const { camera, height_px, focus } = screen;
    this.ruler.group.visible = false;
    this.axes.group.visible = false;
    this.scaleBar.update(umPerPixelAt(focus, camera, height_px, m_per_um));
    this.orientation.root.style.display = "";
    this.orientation.update(head, specimen);
    this.name.showOnScreen();
  }

  private showMeasured(): void {
    const { measured, measuredAs, measurements } = this.state;
    this.measured.show(measured, measuredAs, this.options.reading.sourcesKey(measured));
    this.measured.list(measurements);
  }

  private nameOf(gaze: Ray): Named | null {
    const probed = this.options.reading.glance(gaze);
    if (probed === null) return null;
    const channel = this.state.channels.find(({ id }) => id === probed.channel);
    const { tiles } = this.state;
    const tile = tiles.length > 1 ? tileName(probed.tile, tiles) : ""; // of a single one there is nothing to tell
    const text = [tile, channel?.name ?? ""].filter((part) => part !== "").join(" · ");
    return text === "" ? null : { probed, text };
  }

  dispose(): void {
    this.isDisposed = true;
    this.handles.dispose();
    this.lamps.dispose();
    this.measured.dispose();
    this.scaleBar.dispose();
    this.orientation.dispose();
    this.name.dispose();
    this.ruler.dispose();
    this.axes.dispose();
    this.group.removeFromParent();
  }
}
