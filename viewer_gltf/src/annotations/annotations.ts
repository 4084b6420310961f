/**
 * Everything that is drawn over the specimen without being a part of it: the handles of the clip and of the lamps,
 * measurements, scale bar, orientation axes and names. It also finds the handle that a ray points at.
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
import { NO_EYE_VIEW } from "../marks/eye_view";
import { dragLamp, isLampHandle, lampHandles } from "../marks/lamp_handles";
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

/** Notice if the measuring ray hits nothing. */
const NOTHING_HIT = "No point was set, because there is no surface, volume or slice at that place.";
/** Largest movement of the gaze of a head at rest, in metres of the scene. */
const TREMBLE_M = 0.03;

export type MarksOptions = Readonly<{
  manifest: Manifest;
  /** Finds what rays meet, and the values at points. */
  reading: Reading;
  /** Surfaces on screen now. */
  surfaces: () => readonly ShownSurface[];
  dispatch: (action: Action) => void;
  /** Shows a notice to the user. */
  announce: (text: string) => void;
  /** Called when the frame has to be drawn again. */
  onChange: () => void;
}>;

export class Marks {
  /** Child of the specimen's group, in um. */
  readonly group = new Object3D();
  readonly handles = new ClipMark();
  readonly lamps = new LampMark();
  /** The handles as a target of gaze and hands in stereo. */
  readonly target: HandleTarget;
  readonly measured: MeasureMark;
  readonly scaleBar = new ScaleBarMark();
  readonly orientation: OrientationMark;
  readonly name = new NameMark();
  readonly ruler = new Ruler();
  readonly axes: Axes;
  /** The eye of the last frame. */
  private eyeView = NO_EYE_VIEW;
  /** The dragged lamp, while the ray passes beside the sphere on which the lamp moves; otherwise null. */
  private beside: HandleId | null = null;
  /** The clip with which the page opened. */
  private readonly opening: Clip;
  /** Whether the user has pointed at the frame since the page opened. */
  private isPointedAt = false;
  /** The clip when stereo began; null on a flat screen. */
  private cutAtEntry: ViewerState["clip"] | null = null;
  /** Number of surfaces on screen in the last frame. */
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
    this.sync(state);
  }

  /** Elements that the page places over the canvas. */
  get overlayElements(): readonly (HTMLElement | SVGElement)[] {
    return [this.scaleBar.root, this.orientation.root, this.name.root];
  }

  /** Objects that the depth pass must leave out. */
  get overlays(): readonly Object3D[] {
    return [this.group];
  }

  sync(state: ViewerState): void {
    this.state = state;
    this.handles.show(markedClip(state.clip, this.opening, this.isPointedAt), this.shown);
    this.lamps.show(state, this.specimen);
    const cuts = handlesOf(state.clip, this.shown);
    this.target.handles = [...cuts, ...lampHandles(state, this.specimen)];
    this.showMeasured();
    this.name.forget();
  }

  /** Called for every frame, also if it is not drawn. */
  update(view: FrameView): void {
    this.eyeView = view.eyeView;
    this.target.specimen = view.specimen;
    this.cutAtEntry = view.screen === null ? (this.cutAtEntry ?? this.state.clip) : null;
    this.target.isCutAsleep = this.cutAtEntry === this.state.clip;
    const m_per_um = view.specimen.getMaxScaleOnAxis();
    const surfaces = this.options.surfaces().length;
    if (surfaces !== this.surfaces) this.name.lookUpAgain(); // surfaces load and refine while the gaze rests
    this.surfaces = surfaces;
    this.name.follow(view.gaze, TREMBLE_M / m_per_um, view.dt_s, () => this.nameOf(view.gaze));
    if (this.state.measured.length > 0) this.showMeasured(); // volumes load and refine, which changes the values
    if (view.screen === null) this.updateInStereo(view);
    else this.updateOnScreen(view, view.screen, m_per_um);
    this.handles.update(this.eyeView);
    this.lamps.update(this.eyeView);
    this.measured.update(this.eyeView);
  }

  /** For each measured point, the loaded values of the shown channels, such as `DAPI 1210`. */
  get values(): readonly (readonly string[])[] {
    return this.state.measured.map((_, i) =>
      this.measured
        .valuesAt(i)
        .split("\n")
        .filter((line) => line !== ""),
    );
  }

  /** Reads the values of the measured points again. */
  rereadValues(): void {
    this.measured.rereadValues();
  }

  /** Returns the handle that a ray in um points at. */
  pick(ray: Ray, pointing: Pointing): HandleId | null {
    this.showHandles();
    return pickHandle(ray, this.target.handles, this.eyeView.zoom * TOLERANCE_RAD[pointing]);
  }

  /** Drags a handle along with a ray in um. */
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

  /** Highlights the handle that is pointed at or held; null: none. */
  highlight(id: HandleId | null): void {
    if (!this.handles.highlight(id)) return;
    this.lamps.highlight(id);
    this.lamps.show(this.state, this.specimen);
    this.options.onChange();
  }

  /** Adds the point that a ray in um hits to the newest measurement, or starts another one with it. */
  async measure(ray: Ray): Promise<void> {
    const found = await this.options.reading.probe(ray);
    if (this.isDisposed) return;
    if (found === null) this.options.announce(NOTHING_HIT);
    else this.options.dispatch({ type: "add-point", point: found.point });
  }

  /** Shows the handles of the opening clip as soon as the user points at the frame: see `markedClip`. */
  private showHandles(): void {
    if (this.isPointedAt) return;
    this.isPointedAt = true;
    if (this.state.clip !== this.opening) return;
    this.sync(this.state);
    this.options.onChange();
  }

  /** Box of the shown specimen or of the isolated tile, in um. */
  private get shown(): Box {
    return shownBox(this.options.manifest, this.state.isolated);
  }

  private get specimen(): Box {
    return this.options.manifest.specimen.bounds_um;
  }

  private updateInStereo({ isPanelOpen, isBarBelow }: FrameView): void {
    const { eyeView, shown } = this;
    this.showHandles();
    this.highlight(this.target.takeSeen());
    this.scaleBar.update(null);
    this.orientation.root.style.display = "none";
    this.ruler.update(shown, eyeView, isBarBelow);
    if (isPanelOpen) this.ruler.group.visible = false;
    this.axes.group.visible = !isPanelOpen;
    this.axes.update(shown, eyeView);
    this.name.placeInStereo(eyeView);
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
    // if the specimen has only one tile, its name is not shown
    const tile = tiles.length > 1 ? tileName(probed.tile, tiles) : "";
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
