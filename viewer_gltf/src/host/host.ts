/** The host of the viewer's parts: the state, its history, the parts, and the display. */
import type { Object3D, Vector2 } from "three";
import type { Bundle } from "../bundle/load";
import type { ValuesHost } from "../bundle/values_host";
import type { Ray } from "../math/vec3";
import type { Lenses } from "../panel/controls";
import type { KeyTable } from "../panel/keys";
import type { Remedies } from "../panel/remedies";
import type { Reading } from "../probe/probe_reader";
import type { Theme } from "../render/theme";
import type { Action } from "../state/actions";
import { announcementOf } from "../state/announce_change";
import type { Command } from "../state/commands";
import { initialState } from "../state/initial_state";
import { addSettings } from "../state/part_settings";
import { newNotice, reduce } from "../state/reduce";
import { Signal } from "../state/signal";
import type { ViewerState } from "../state/viewer_state";
import type { Stereo } from "../xr/stereo";
import { makeRenderer } from "./canvas";
import { Commands } from "./commands";
import { Faults } from "./faults";
import type { Focus } from "./form";
import { GpuDisplay } from "./gpu_display";
import { watchContext } from "./graphics_context";
import { PanelModel } from "./panel_model";
import type { Hit, PartDefinition, PartHost, SharedFrame } from "./part";
import { inOrder, Parts } from "./parts";
import type { Services } from "./services";
import { Taps } from "./taps";
import { Undo } from "./undo";
import type { Viewpoint } from "./viewpoint";

/**
 * Shows a bundle in an element of a page.
 *
 * ```ts
 * import * as parts from "../app/parts";
 * import { loadBundle } from "../bundle/load";
 * import { Host } from "./host";
 *
 * const [view, stage] = [document.createElement("main"), document.createElement("div")];
 * view.append(stage);
 * const bundle = await loadBundle("https://lab.example/specimen/");
 * const host = new Host(bundle, stage, view, Object.values(parts));
 * host.changed.subscribe(({ mode }) => view.setAttribute("data-mode", mode));
 * host.dispatch({ type: "show", channel: bundle.manifest.channels[0].id, shown: false });
 * await host.display.settled();
 * host.dispose();
 * ```
 */
export class Host implements PartHost {
  readonly display: GpuDisplay;
  readonly undo: Undo;
  readonly panel: PanelModel;
  readonly changed = new Signal<ViewerState>();
  readonly drawn = new Signal<void>();
  readonly announced = new Signal<string>();
  readonly revealed = new Signal<string>();
  readonly lensesChosen = new Signal<Lenses>();
  state: ViewerState;
  private readonly parts: Parts;
  private readonly faults: Faults;
  private readonly taps: Taps;
  private readonly commands: Commands;
  private readonly disposed = new AbortController();

  /** @param view the part of the page with the stage */
  constructor(
    readonly bundle: Bundle,
    readonly stage: HTMLElement,
    readonly view: HTMLElement,
    definitions: readonly PartDefinition[],
  ) {
    const { manifest } = bundle;
    const { signal } = this.disposed;
    const renderer = makeRenderer(stage);
    const gl = renderer.getContext();
    for (const { id, settings } of definitions) {
      if (settings !== undefined) addSettings(id, settings);
    }
    this.state = initialState(
      manifest,
      definitions.some(({ canTrace }) => canTrace?.(gl) ?? false),
    );
    this.parts = new Parts(definitions);
    this.faults = new Faults({
      state: () => this.state,
      dispatch: (action) => this.dispatch(action),
      isIncomplete: () => this.display.forms.isIncomplete,
    });
    this.display = this.makeDisplay(renderer);
    this.undo = new Undo({
      ...{ viewpoint: this.display.viewpoint, signal },
      state: () => this.state,
      isInStereo: () => this.isInStereo,
      restore: (state) => this.dispatch({ type: "restore", state }),
      announce: (text) => this.announce(text),
      onChange: () => this.changed.emit(this.state),
    });
    this.panel = new PanelModel(manifest, () => ({
      ...{ manifest, state: this.state, undo: this.undo },
      snapshot: () => this.display.snapshot(),
      sections: (view) => this.parts.sections(view),
    }));
    this.taps = new Taps(this, this.parts, signal);
    this.commands = new Commands({
      ...{ host: this, parts: this.parts, taps: this.taps },
      retry: () => this.retry(),
    });
    for (const { create } of inOrder(definitions)) this.parts.add(create(this));
    watchContext(this.canvas, this.display, (action) => this.dispatch(action));
    addEventListener("online", () => this.retry(), { signal });
    this.display.start();
    this.parts.begin();
  }

  /** Called once, when the viewer has the settings and the camera of the page's address. */
  noteOpening(): Promise<void> {
    return this.parts.afterOpening();
  }

  /** Called when the overview is on screen. */
  noteOverview(): Promise<void> {
    return this.parts.afterOverview();
  }

  dispatch(action: Action, isStep = action.type !== "restore"): void {
    const previous = this.state;
    const next = reduce(previous, action);
    if (next === previous) return;
    const notice = newNotice(previous, next);
    const announcement = announcementOf(previous, next, this.bundle.manifest.tiles);
    const { stereo } = this;
    const growth = next.specimenSize_m / previous.specimenSize_m;
    if (isStep) this.undo.add(action, next);
    this.state = next;
    if (growth !== 1) stereo.resize(growth, next);
    if (notice !== null) stereo.announce(notice);
    if (announcement !== null) this.announce(announcement);
    this.sync(previous);
    this.changed.emit(this.state);
  }

  /** @param isOnPage false: the panel in the scene has sent the command */
  run(command: Command, isOnPage = true): boolean {
    return this.commands.run(command, isOnPage);
  }

  get keys(): KeyTable {
    return this.parts.keys;
  }

  get remedies(): Remedies {
    return this.parts.remedies;
  }

  get hasStandingPart(): boolean {
    return this.parts.hasStandingPart;
  }

  get isInStereo(): boolean {
    return this.stereo.kind !== null;
  }

  get canvas(): HTMLCanvasElement {
    return this.display.renderer.domElement;
  }

  get specimen(): Object3D {
    return this.display.specimen;
  }

  get viewpoint(): Viewpoint {
    return this.display.viewpoint;
  }

  get stereo(): Stereo {
    return this.display.stereo;
  }

  get reading(): Reading {
    return this.display.reading;
  }

  get values(): ValuesHost | null {
    return this.display.values;
  }

  get frame(): SharedFrame {
    return this.display.frame;
  }

  get focus(): Focus {
    return this.display.focus;
  }

  get doubleTapped(): Signal<void> {
    return this.taps.doubled;
  }

  rayAt(point: Vector2): Ray {
    return this.taps.rayAt(point);
  }

  announce(text: string): void {
    this.announced.emit(text);
    this.display.stereo.announce(text);
  }

  report(error: unknown): void {
    this.faults.report(error);
  }

  /** Shows a notice while files wait for another attempt; 0 removes it. */
  noteWaiting(files: number): void {
    this.faults.noteWaiting(files);
  }

  service<K extends keyof Services>(name: K): Services[K] | null {
    return this.parts.service(name);
  }

  objectAlong(ray: Ray): Hit | null {
    return this.parts.pick(ray, ({ object }) => object !== undefined);
  }

  /** Draws the background of the flat view. */
  setTheme(theme: Theme, isPlain: boolean): void {
    this.display.background.setTheme(theme, isPlain);
  }

  private makeDisplay(renderer: GpuDisplay["renderer"]): GpuDisplay {
    return new GpuDisplay({
      ...{ bundle: this.bundle, stage: this.stage, renderer, parts: this.parts },
      state: () => this.state,
      dispatch: (action, isStep) => this.dispatch(action, isStep),
      report: (error) => this.report(error),
      sync: () => this.sync(),
      stereo: {
        buildPanel: (view) => this.panel.buildPanel(view),
        onCommand: (command) => this.run(command, false),
        onLenses: (lenses) => this.lensesChosen.emit(lenses),
        onChoose: (ray, tile, isByGaze) => this.taps.choose(ray, tile, isByGaze),
      },
      onStereo: () => this.changed.emit(this.state),
      onFrame: () => this.drawn.emit(),
    });
  }

  /** Updates the display and the parts to the state. */
  private sync(previous = this.state): void {
    this.display.sync(this.state);
    this.parts.sync(this.state, previous);
  }

  /** Requests all files again that failed to load. */
  private retry(): void {
    this.dispatch({ type: "dismiss", texts: this.state.retryable });
    this.parts.retryFailed();
    this.sync();
  }

  dispose(): void {
    this.disposed.abort();
    this.parts.dispose();
    this.display.dispose();
  }
}
