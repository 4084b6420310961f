/** The path-traced volumes: loads their texels, follows the viewer's state, and draws them. */
import { Group, type Matrix4, type Texture, type WebGLRenderer } from "three";
import { TemporaryError } from "../bundle/errors";
import { LAST, Overlay } from "../gpu/composite_pass";
import type { Eyes } from "../gpu/eyes";
import type { Volumes } from "../host/services";
import type { TracedVolumes, TracePace, TraceScene } from "../render/drawn_forms";
import type { ShownVolume } from "../state/on_screen";
import { isTraced } from "../state/parameters/volumes";
import { ENOUGH_SAMPLES } from "../state/path_trace_settings";
import { type ViewerState, volumeChannels } from "../state/viewer_state";
import type { BrickService } from "../voxels/bricks/brick_service";
import type { MarchLight } from "../voxels/march_frame";
import type { VolumeLimits } from "../voxels/mip_levels";
import { EnvironmentLight, PATHS_NOT_LOADED, type StageEnvironment } from "./environment_light";
import type { EnvironmentTables } from "./environment_sampling";
import { MediumChanges } from "./medium_changes";
import type { MediumTexels } from "./medium_loader";
import type { Tracer } from "./path_tracer";
import { PictureScale } from "./picture_scale";
import { TracedMedium } from "./traced_medium";

const FIRST_SAMPLES = 6;

export class TracedVolume implements TracedVolumes {
  private readonly medium: TracedMedium;
  /** Contains the overlay that shows the traced frame. */
  readonly group = new Group();
  /** The path tracer; null: its code has not loaded. */
  private tracer: Tracer | null = null;
  private overlay: Overlay | null = null;
  private coming: Promise<Tracer> | null = null;
  private isDisposed = false;
  private state: ViewerState | null = null;
  private texels: MediumTexels | null = null;
  /** Key of the channels and tiles that are on the GPU, or are being loaded. */
  private wanted = "";
  private hasFailed = false;
  private readonly changes = new MediumChanges();
  private readonly environment: EnvironmentLight;
  private readonly scale = new PictureScale();

  constructor(
    private readonly volumes: Pick<Volumes, "sourcesOf" | "appearances">,
    bricks: BrickService | null,
    private limits: VolumeLimits,
    private readonly sceneDepth: { value: Texture },
    stageEnvironment: StageEnvironment | null,
    private readonly onChange: () => void,
    private readonly onError: (error: unknown) => void,
  ) {
    this.medium = new TracedMedium((channel) => volumes.sourcesOf(channel), bricks, {
      onTexels: (texels) => this.take(texels),
      onRefused: () => {
        this.drop();
        if (this.state !== null) this.sync(this.state);
      },
      onChange,
      onError: (error) => this.fail(error),
    });
    const lightBy = (tables: EnvironmentTables) => this.tracer?.lightBy(tables);
    this.environment = new EnvironmentLight(stageEnvironment, lightBy, onChange, onError);
  }

  get isLoading(): boolean {
    const isPreparing = this.coming !== null && this.tracer === null;
    return isPreparing || this.medium.isLoading || this.environment.isLoading;
  }

  /** Whether path tracing is on and has texels to draw. */
  get isShown(): boolean {
    return this.state !== null && isTraced(this.state) && this.tracer?.isReady === true;
  }

  /** Whether a frame at rest still needs more samples. */
  get isGathering(): boolean {
    return this.isShown && this.samples < ENOUGH_SAMPLES;
  }

  /** Whether the traced frame was shown without the ray-marched one that stands in for it. */
  get standsAlone(): boolean {
    return this.samples >= 1 && this.tracer?.isStoodIn === false;
  }

  status(): Readonly<{ samples: number; level: number | null }> {
    return { samples: this.samples, level: this.isShown ? (this.texels?.level ?? 0) : null };
  }

  private get samples(): number {
    return this.tracer?.samples ?? 0;
  }

  /** The volumes on screen, for a caller that reads values at a point. */
  shown(): readonly ShownVolume[] {
    const { state } = this;
    if (state === null || !this.isShown) return [];
    const tables = (channel: string) => this.volumes.appearances.of(state, channel).table;
    return this.medium.shown(tables, state.isolated);
  }

  sync(state: ViewerState): void {
    this.state = state;
    if (!isTraced(state)) {
      this.drop();
      return;
    }
    if (this.tracer === null) {
      if (!this.hasFailed) void this.prepare().catch((error) => this.fail(error));
      return;
    }
    const channels = volumeChannels(state).map(({ id }) => id);
    const tiles = state.isolated === null ? state.tiles.map(({ id }) => id) : [state.isolated];
    const wanted = JSON.stringify([channels, tiles]);
    if (wanted !== this.wanted) {
      this.drop();
      this.wanted = wanted;
      if (channels.length > 0) void this.medium.load({ channels, tiles }, this.limits);
    }
    this.environment.sync(state.trace.environment);
    this.setAppearances();
  }

  /** Lights the scene by a file of the user. The caller then has to set the environment in the state to "own". */
  async lightBy(file: File): Promise<void> {
    await this.prepare();
    await this.environment.lightBy(file);
  }

  /** Limits the texture's edge, in texels, from the next `sync` on. */
  limitEdge(edge: number): void {
    this.limits = { ...this.limits, edge };
    this.drop();
  }

  retryFailed(): void {
    if (this.hasFailed) this.drop();
    this.environment.retryFailed();
  }

  /** Drops all references to GPU resources, because the WebGL context is lost. */
  forget(): void {
    this.drop();
    this.environment.forget();
  }

  render(renderer: WebGLRenderer, eyes: Eyes, scene: TraceScene, pace: TracePace): void {
    const { resolution, isMoving, passes, standIn } = pace;
    const { tracer, overlay } = this;
    if (this.state === null || tracer === null || overlay === null) return;
    const isWorn = eyes.all.length > 1; // a headset moves a little all the time
    const isOther = isMoving && !tracer.goesOn(eyes, scene, isWorn);
    // a moving view is ray-marched if possible, which is sharp and leaves no afterimage of the previous view
    if (isOther && !isWorn && standIn !== null) {
      tracer.standIn(renderer, eyes, scene, this.state.trace, standIn);
      overlay.show(eyes, tracer.scale);
      return;
    }
    // after a movement the small frame gathers a few samples, and then tracing begins again at full size
    const isClearing = this.scale.isSmall && tracer.rested < FIRST_SAMPLES && standIn === null;
    const isFirst = isOther || isClearing;
    this.scale.allow(resolution, isMoving, isOther);
    const scale = this.scale.choose(eyes, isFirst);
    tracer.render(renderer, eyes, scene, this.state.trace, {
      scale,
      passes: isFirst ? 1 : isMoving ? Math.min(1, passes) : passes,
      mayTremble: isWorn,
      isDraft: isFirst,
      standIn,
    });
    overlay.show(eyes, tracer.scale);
  }

  /**
   * Lights the ray-marched frame, which stands in for the traced one, in the same way.
   *
   * @param specimen pose of the specimen in the scene
   */
  lightMarch(march: MarchLight, specimen: Matrix4, head: Matrix4): void {
    if (this.state === null) return;
    const toEye = head.clone().invert().multiply(specimen);
    this.tracer?.lightMarch(march, this.state.trace, toEye);
  }

  /** Shows more of the loaded bricks. Returns whether some are still hidden. */
  advance(dt_s: number): boolean {
    return this.medium.advance(dt_s);
  }

  hide(): void {
    this.overlay?.hide();
  }

  get isOnScreen(): boolean {
    return this.overlay?.mesh.visible === true;
  }

  /** Loads the code of the path tracer when it is first needed. */
  private prepare(): Promise<Tracer> {
    this.coming ??= import("./path_tracer")
      .catch((cause) => {
        this.coming = null;
        throw new TemporaryError(PATHS_NOT_LOADED, { cause });
      })
      .then(({ Tracer }) => {
        const tracer = new Tracer(this.sceneDepth);
        if (this.isDisposed) {
          tracer.dispose();
          return tracer;
        }
        this.tracer = tracer;
        this.overlay = new Overlay(tracer.picture.texture, this.sceneDepth, {
          order: LAST,
          isEncoded: true,
        });
        this.group.add(this.overlay.mesh);
        if (this.state !== null) this.sync(this.state);
        this.onChange();
        return tracer;
      });
    return this.coming;
  }

  private fail(error: unknown): void {
    this.hasFailed = true;
    this.onError(error);
    this.onChange();
  }

  private drop(): void {
    this.medium.drop();
    this.wanted = "";
    this.changes.forget();
    this.hasFailed = false;
    if (this.texels === null) return;
    this.texels = null;
    this.tracer?.fill(null);
  }

  private take(texels: MediumTexels): void {
    this.texels = texels;
    this.changes.forget();
    this.tracer?.fill(texels);
    this.setAppearances();
    this.onChange();
  }

  /** Updates the medium if the state's colours, transfer functions or light have changed. */
  private setAppearances(): void {
    const { state, texels } = this;
    if (state === null || texels === null) return;
    const appearances = texels.channels.map((id) => this.volumes.appearances.of(state, id));
    if (this.medium.lacks(appearances)) {
      this.medium.refuseBricks();
      return;
    }
    const change = this.changes.since(appearances, state.trace);
    if (change === "appearance") this.tracer?.setAppearances(appearances, state.trace);
    else if (change === "light") this.tracer?.restart();
  }

  dispose(): void {
    this.drop();
    this.medium.dispose();
    this.isDisposed = true;
    this.tracer?.dispose();
    this.overlay?.dispose();
  }
}
