/** Everything that draws the specimen: the scene, its contents, the eyes and the frame loop. */
import type { Object3D, WebGLRenderer } from "three";
import type { Bundle } from "../bundle/load";
import { ValuesHost } from "../bundle/values_host";
import { shownBox } from "../math/pick";
import { Reading } from "../probe/probe_reader";
import type { FrameRenderer } from "../render/frame_renderer";
import { GazeFocus } from "../render/gaze_focus";
import { SpecimenScene } from "../render/specimen_scene";
import type { Action } from "../state/actions";
import { setTo } from "../state/parameters/kinds";
import { SCREEN_STEREO } from "../state/parameters/tools";
import type { ViewerState } from "../state/viewer_state";
import { Stereo, type StereoOptions } from "../xr/stereo";
import { Background } from "./background";
import { CanvasFit } from "./canvas";
import type { Focus } from "./form";
import { Forms } from "./forms";
import { FrameLoop } from "./frame_loop";
import type { Display, FrameView } from "./part";
import type { Parts } from "./parts";
import { type Snapshot, snapshotOf } from "./snapshot";
import type { StillMaker } from "./still";
import { Viewpoint } from "./viewpoint";

export type DisplayOptions = Readonly<{
  bundle: Bundle;
  renderer: WebGLRenderer;
  /** Contains the canvas. */
  stage: HTMLElement;
  parts: Parts;
  state: () => ViewerState;
  dispatch: (action: Action, isStep?: boolean) => void;
  report: (error: unknown) => void;
  stereo: Pick<StereoOptions, "buildPanel" | "onCommand" | "onLenses" | "onChoose">;
  /** Updates the display and the parts to the state again. */
  sync: () => void;
  /** Called when stereo has begun or ended. */
  onStereo: () => void;
  /** Called after every frame. */
  onFrame: () => void;
}>;

export class GpuDisplay implements Display {
  readonly renderer: WebGLRenderer;
  readonly forms: Forms;
  /** Voxel values as they were measured; null: the host of the page does not serve them. */
  readonly values: ValuesHost | null;
  readonly reading: Reading;
  readonly viewpoint: Viewpoint;
  readonly stereo: Stereo;
  readonly background: Background;
  private readonly specimenScene: SpecimenScene;
  private readonly hybrid: GazeFocus;
  private readonly loop: FrameLoop;
  private readonly canvas: CanvasFit;
  /** CSS pixels per inch of this screen; null: estimated from the name of the browser. */
  private perInch: number | null = null;

  constructor(private readonly options: DisplayOptions) {
    const { bundle, renderer, stage } = options;
    const { manifest } = bundle;
    const { bounds_um: bounds } = manifest.specimen;
    this.renderer = renderer;
    this.specimenScene = new SpecimenScene(manifest);
    this.hybrid = new GazeFocus(manifest);
    const onChange = () => this.redraw();
    this.viewpoint = new Viewpoint({
      ...{ canvas: renderer.domElement, bounds, specimen: this.specimenScene.specimen, onChange },
      stereo: () => this.stereo,
    });
    this.loop = this.makeLoop();
    this.forms = new Forms(options.parts, manifest);
    this.values = bundle.values === undefined ? null : new ValuesHost(bundle.values);
    this.reading = this.makeReading();
    this.stereo = this.makeStereo();
    this.background = new Background(this.specimenScene, onChange);
    this.canvas = new CanvasFit(renderer, stage, this.viewpoint.navigation, onChange);
  }

  /** Starts to draw, after all parts have been made. */
  start(): void {
    const { parts, sync } = this.options;
    for (const group of parts.groups) this.specimenScene.specimen.group.add(group);
    sync();
    this.loop.start();
  }

  /**
   * Updates the scene, stereo and the quality to a state. The host updates the parts of the viewer
   * itself.
   */
  sync(state: ViewerState): void {
    const { isolated, selected, quality, eyeDistance_mm, stereoStrength } = state;
    this.stereo.setEyes({
      distance_m: eyeDistance_mm / 1000,
      strength: stereoStrength,
      cssPixelsPerInch: this.perInch,
    });
    const { manifest } = this.options.bundle;
    this.specimenScene.specimen.show(isolated === null ? null : shownBox(manifest, isolated));
    this.followScreenStereo(state);
    this.reading.state = state;
    this.specimenScene.mark(isolated === null ? selected : null);
    this.loop.setLevel(quality);
    this.redraw();
  }

  requestFrame(): void {
    this.loop.requestFrame();
  }

  redraw(): void {
    this.loop.redraw();
  }

  get studio(): StillMaker {
    return this.loop.studio;
  }

  get frames(): number {
    return this.loop.frames;
  }

  get isLate(): boolean {
    return this.loop.isLate;
  }

  nextFrame(): Promise<void> {
    return this.loop.nextFrame();
  }

  /** Resolves once the overview of every shown channel is on screen. */
  async overviewShown(): Promise<void> {
    for (;;) {
      const before = this.frames;
      if (this.forms.overview.isComplete && before > 0) return;
      await new Promise((resolve) => requestAnimationFrame(resolve));
    }
  }

  async settled(): Promise<void> {
    await this.background.settled;
    return this.loop.settled();
  }

  get focus(): Focus {
    const { focusTiles, mayRefine } = this.hybrid;
    return { focusTiles, mayRefine, hasOverview: this.forms.hasOverview };
  }

  /** The renderer of frames. All shaders of the scene share its uniforms. */
  get frame(): FrameRenderer {
    return this.loop.scene.picture;
  }

  /** The scene object that contains the specimen; its matrix maps um to metres of the scene. */
  get specimen(): Object3D {
    return this.specimenScene.specimen.group;
  }

  setScreen(perInch: number | null): void {
    this.perInch = perInch;
    this.options.sync();
  }

  get cssPixelsPerInch(): number | null {
    return this.perInch;
  }

  fit(): void {
    this.canvas.fit();
  }

  limitEdge(edge: number): void {
    this.forms.limitEdge(edge);
    this.options.sync();
  }

  get isLoading(): boolean {
    return this.options.parts.isLoading;
  }

  snapshot(): Snapshot {
    const { parts, state } = this.options;
    const { renderer, specimenScene, hybrid, forms, stereo, viewpoint, loop } = this;
    const measuredValues = parts.service("measured")?.values ?? [];
    const { isLoading } = this;
    const drawn = { renderer, specimenScene, hybrid, forms, stereo, viewpoint, loop };
    return snapshotOf({ ...drawn, state: state(), isLoading, measuredValues });
  }

  /** Drops the textures and timers after the graphics context was lost. */
  forget(): void {
    this.forms.forget();
    this.loop.forget();
  }

  /** Makes new textures and timers after the graphics context was restored. */
  renew(): void {
    this.forms.forget(); // drops textures that were made while the context was lost
    this.loop.renew();
    this.options.sync();
  }

  private makeLoop(): FrameLoop {
    const { bundle, renderer, stage, parts, state, sync, onFrame } = this.options;
    return new FrameLoop({
      ...{ renderer, stage, onFrame, specimenScene: this.specimenScene, hybrid: this.hybrid },
      bounds: bundle.manifest.specimen.bounds_um,
      shown: () => {
        const { forms, stereo, viewpoint } = this;
        return { forms, parts, stereo, viewpoint, state: state() };
      },
      onAdvance: (frame) => this.advance(frame),
      onFocus: sync,
      onOverview: sync,
    });
  }

  private advance(frame: FrameView): void {
    this.reading.specimen = frame.specimen;
    this.reading.disc = frame.disc;
    this.options.parts.advance(frame);
  }

  private makeReading(): Reading {
    const { bundle, parts, report, state } = this.options;
    const { forms, values } = this;
    const options = {
      values,
      manifest: bundle.manifest,
      base: bundle.base,
      surfaces: () => parts.service("surfaces")?.meshes ?? [],
      volumes: () => forms.shownVolumes,
      source: (tile: string, channel: string) =>
        parts.service("volumes")?.source(tile, channel) ?? null,
      sourceOf: async (tile: string, channel: string) =>
        (await parts.service("volumes")?.sourceOf(tile, channel)) ?? null,
      pick: (ray: Parameters<Parts["pick"]>[0]) =>
        parts.pick(ray, ({ object }) => object === undefined),
      corner: (eye: Parameters<Parts["cutBefore"]>[0]) => parts.cutBefore(eye),
      onError: report,
    };
    return new Reading(options, state());
  }

  private makeStereo(): Stereo {
    const { bundle, renderer, parts, state, dispatch, onStereo } = this.options;
    return new Stereo(renderer, {
      ...this.options.stereo,
      scene: this.specimenScene.scene,
      specimen: this.specimenScene.specimen,
      tiles: bundle.manifest.tiles,
      handles: () => parts.targets,
      onAction: dispatch,
      objectAlong: (ray) => {
        const hit = parts.pick(ray, ({ object }) => object !== undefined);
        const length_um = Math.hypot(...ray.direction);
        const id = `${hit?.channel}/${hit?.object?.row}`;
        return hit && { id, distance: hit.distance_um / length_um };
      },
      onStart: () => {
        this.viewpoint.enterStereo(state().specimenSize_m);
        onStereo();
      },
      onEnd: () => {
        this.viewpoint.leaveStereo();
        this.fit();
        onStereo();
      },
    });
  }

  /** Switches the stereo on the page's own screen to the one in the state. */
  private followScreenStereo({ screenStereo }: ViewerState): void {
    const { stage, dispatch, report } = this.options;
    if (stage.dataset.stereo === screenStereo) return;
    stage.dataset.stereo = screenStereo;
    this.stereo.screen.show(screenStereo).then(
      () => this.redraw(),
      (error) => {
        report(error);
        dispatch(setTo(SCREEN_STEREO, "off"), false);
      },
    );
    this.fit();
  }

  dispose(): void {
    this.loop.stop();
    this.stereo.dispose();
    this.viewpoint.dispose();
    this.reading.dispose();
    this.loop.dispose();
    this.canvas.dispose();
  }
}
