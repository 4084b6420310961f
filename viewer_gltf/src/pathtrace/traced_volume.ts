/** The path-traced picture's subject: follows the state, loads what is missing, and is drawn. */
import { Group, type Matrix4, type Texture, type WebGLRenderer } from "three";
import { viewerAddress } from "../bundle/address";
import { BundleError, TemporaryError } from "../bundle/errors";
import { LAST, Overlay } from "../gpu/composite_pass";
import type { Eyes } from "../gpu/eyes";
import type { ShownVolume } from "../state/on_screen";
import { isTraced } from "../state/parameters/volumes";
import { ENOUGH_SAMPLES, gathersAnew, type TraceSettings } from "../state/path_trace_settings";
import { type ViewerState, volumeChannels } from "../state/viewer_state";
import type { BrickTile } from "../volumes/bricks/brick_atlas";
import type { BrickService } from "../volumes/bricks/brick_service";
import type { MarchLight } from "../volumes/march_frame";
import type { Appearance } from "../volumes/march_tables";
import { showsBelow } from "../volumes/marches";
import type { VolumeLimits } from "../volumes/mip_levels";
import type { Packed } from "../volumes/tile_texture";
import type { TransferTable2d } from "../volumes/transfer_table_2d";
import type { VolumeSource } from "../volumes/volume_source";
import type { Marched } from "./denoise_and_tone";
import { loadEnvironment, readEnvironment } from "./environment_file";
import { type ChannelSources, MediumLoader, type MediumTexels, withVolumes } from "./medium_loader";
import type { Tracer } from "./path_tracer";
import { frameOf } from "./texel_frame";
import type { TraceScene } from "./uniforms";

const NOT_LOADED = "The part of the page that follows light could not be had.";
/** Most pixels of a picture: more take more memory than a phone's browser gives. */
const MAX_PIXELS = 2_000_000;
const FIRST_SAMPLES = 6;
/** Most pixels while the picture moves: the denoiser fills in the rest. */
const MAX_MOVING_PIXELS = 160_000;

/** The part of the volumes that the tracer uses. */
export type Volumes = Readonly<{
  sourcesOf: (channel: string) => Promise<ReadonlyMap<string, VolumeSource> | null>;
  appearances: Readonly<{ of: (state: ViewerState, channel: string) => Appearance }>;
}>;

export class TracedVolume {
  private readonly loader = new MediumLoader();
  /** What is drawn of it. */
  readonly group = new Group();
  /** null: not asked for yet, or on its way. */
  private tracer: Tracer | null = null;
  private overlay: Overlay | null = null;
  private coming: Promise<Tracer> | null = null;
  private isDisposed = false;
  private state: ViewerState | null = null;
  private texels: MediumTexels | null = null;
  private sources: readonly ChannelSources[] = [];
  private loading: AbortController | null = null;
  /** What is on the GPU or on its way there: channels and tiles. */
  private wanted = "";
  private hasFailed = false;
  private hasLightFailed = false;
  /** Where texels come from as bricks; null: as files. */
  private brickTile: BrickTile | null = null;
  private packed: Packed | null = null;
  /** The present look of the medium. */
  private dressed = "";
  private tables2d: readonly (TransferTable2d | null)[] = [];
  private settings: TraceSettings | null = null;
  private environment = "";
  private isLightComing = false;
  /** Whether the picture is the small one of a moving view, and how small. */
  private isSmall = false;
  private resolution = 1;
  private resolutionAtRest = 1;

  constructor(
    private readonly volumes: Volumes,
    private readonly bricks: BrickService | null,
    private limits: VolumeLimits,
    private readonly sceneDepth: { value: Texture },
    private readonly onChange: () => void,
    private readonly onError: (error: unknown) => void,
  ) {}

  get isLoading(): boolean {
    const isPreparing = this.coming !== null && this.tracer === null;
    const isComing = this.loading !== null || this.brickTile?.isLoading === true;
    return isPreparing || isComing || this.isLightComing;
  }

  /** Whether there is anything to draw. */
  get isShown(): boolean {
    return this.state !== null && isTraced(this.state) && this.tracer?.isReady === true;
  }

  /** Whether a picture at rest still gathers. */
  get isGathering(): boolean {
    return this.isShown && this.samples < ENOUGH_SAMPLES;
  }

  /** Whether its picture was shown alone: nothing was seen of the march. */
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
    return this.sources.flatMap(({ id, tiles }) => {
      const { table } = this.volumes.appearances.of(state, id);
      return [...tiles].flatMap(([tile, source]) => {
        const isHidden = state.isolated !== null && tile !== state.isolated;
        return isHidden ? [] : [{ tile, channel: id, source, table, isInDisc: false }];
      });
    });
  }

  follow(state: ViewerState): void {
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
      if (channels.length > 0) void this.load(channels, tiles);
    }
    if (state.trace.environment !== "own" && state.trace.environment !== this.environment) {
      void this.light(state.trace.environment);
    }
    this.setAppearances();
  }

  /** Light by a file of the user's; the state then has to hold "own". */
  async lightBy(file: File): Promise<void> {
    const [tables, tracer] = await Promise.all([readEnvironment(file), this.prepare()]);
    tracer.lightBy(tables);
    this.environment = "own";
  }

  /** From the next `follow` on. */
  limitEdge(edge: number): void {
    this.limits = { ...this.limits, edge };
    this.drop();
  }

  retryFailed(): void {
    if (this.hasFailed) this.drop();
    if (this.hasLightFailed) this.environment = "";
  }

  /** What is on the GPU went with its context. */
  forget(): void {
    this.drop();
    this.environment = "";
  }

  /**
   * @param resolution of the march, 0..1: the frame's budget
   * @param passes samples of every pixel
   * @param standIn the march's picture of the same view; null: there is none
   */
  render(
    renderer: WebGLRenderer,
    eyes: Eyes,
    scene: TraceScene,
    resolution: number,
    isMoving: boolean,
    passes: number,
    standIn: Marched | null,
  ): void {
    const { tracer, overlay } = this;
    if (this.state === null || tracer === null || overlay === null) return;
    const isWorn = eyes.all.length > 1; // by a head, which never rests
    const isOther = isMoving && !tracer.goesOn(eyes, scene, isWorn);
    // a view that moves is marched where it can be: sharp, and without a trace of the view before
    if (isOther && !isWorn && standIn !== null) {
      tracer.standIn(renderer, eyes, scene, this.state.trace, standIn);
      overlay.show(eyes, tracer.scale);
      return;
    }
    // what came to rest first clears up as it is, then is begun anew at its full size
    const isClearing = this.isSmall && tracer.rested < FIRST_SAMPLES && standIn === null;
    const isFirst = isOther || isClearing;
    this.isSmall = isFirst;
    const most = isFirst ? MAX_MOVING_PIXELS : MAX_PIXELS;
    const fits = Math.sqrt(most / (eyes.width_px * eyes.height_px));
    if (isOther) this.resolution = resolution;
    if (!isMoving) this.resolutionAtRest = resolution;
    const scale = Math.min(isFirst ? this.resolution : this.resolutionAtRest, fits);
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
   * Light the march that stands in as paths of light do.
   *
   * @param specimen its pose in the room
   */
  lightMarch(march: MarchLight, specimen: Matrix4, head: Matrix4): void {
    if (this.state === null) return;
    const toEye = head.clone().invert().multiply(specimen);
    this.tracer?.lightMarch(march, this.state.trace, toEye);
  }

  /** Show what has come of bricks; whether there is more. */
  advance(dt_s: number): boolean {
    return this.brickTile?.advance(dt_s) ?? false;
  }

  hide(): void {
    this.overlay?.hide();
  }

  get isOnScreen(): boolean {
    return this.overlay?.mesh.visible === true;
  }

  /** What follows the paths: a part of the page that is fetched when it is first asked for. */
  private prepare(): Promise<Tracer> {
    this.coming ??= import("./path_tracer")
      .catch((cause) => {
        this.coming = null;
        throw new TemporaryError(NOT_LOADED, { cause });
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
        if (this.state !== null) this.follow(this.state);
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
    this.loading?.abort();
    this.loading = null;
    this.wanted = this.dressed = "";
    this.brickTile?.dispose();
    this.brickTile = null;
    this.packed = null;
    this.hasFailed = false;
    if (this.texels === null) return;
    this.texels = null;
    this.tracer?.fill(null);
  }

  private async load(channels: readonly string[], tiles: readonly string[]): Promise<void> {
    const abort = new AbortController();
    this.loading = abort;
    try {
      const found = await Promise.all(
        channels.map(async (id) => ({ id, tiles: await this.volumes.sourcesOf(id) })),
      );
      if (abort.signal.aborted) return;
      this.sources = withVolumes(found);
      if (this.sources.length > 0 && !this.streams(tiles)) {
        await this.loader.load(this.sources, tiles, this.limits, abort.signal, (texels) => {
          this.texels = texels;
          this.dressed = "";
          this.tracer?.fill(texels);
          this.setAppearances();
          this.onChange();
        });
      }
    } catch (error) {
      if (!abort.signal.aborted) this.fail(error);
    } finally {
      if (this.loading === abort) this.loading = null;
      this.onChange();
    }
  }

  /** Bricks by view, of a single tile, where the host sends them; whether it does. */
  private streams(tiles: readonly string[]): boolean {
    const [tile] = tiles;
    const [first] = this.sources;
    const volume = first.tiles.get(tile)?.volume;
    if (tiles.length !== 1 || volume === undefined || this.bricks === null) return false;
    const made = this.bricks.tile(
      tile,
      this.limits,
      () => this.takeBricks(),
      () => this.loadFiles(),
    );
    if (made === null) return false;
    const sources = this.sources.flatMap(({ id, tiles: of }) => {
      const source = of.get(tile);
      return source === undefined ? [] : [[id, source] as const];
    });
    this.brickTile = made;
    made.want(new Map(sources));
    return true;
  }

  /** What has come of the bricks, from time to time. */
  private takeBricks(): void {
    const { brickTile } = this;
    if (brickTile?.shown != null && brickTile.shown !== this.packed) {
      const { shown } = brickTile;
      this.packed = shown;
      const [source] = brickTile.kept.values();
      const frame = frameOf([source.volume]);
      const { channels, level, texture, index, bricks } = shown;
      const release = () => undefined; // the tile's own
      this.texels = { channels, frame, level, size: frame.size, texture, index, bricks, release };
      this.dressed = "";
      this.tracer?.fill(this.texels);
      this.setAppearances();
    }
    this.onChange();
  }

  /** The tile can't be had as bricks, or not for what it is to show. */
  private loadFiles(): void {
    if (this.brickTile === null) return;
    const [{ tile }] = [...this.brickTile.kept.values()].map(({ volume }) => volume);
    this.bricks?.refuse(tile);
    this.drop();
    if (this.state !== null) this.follow(this.state);
  }

  private async light(name: string): Promise<void> {
    this.environment = name;
    this.hasLightFailed = false;
    this.isLightComing = true;
    try {
      const tables = await loadEnvironment(viewerAddress(), name);
      if (this.environment === name) this.tracer?.lightBy(tables);
    } catch (error) {
      if (!(error instanceof BundleError)) throw error;
      this.hasLightFailed = true;
      this.onError(error);
    } finally {
      this.isLightComing = false;
      this.onChange();
    }
  }

  /** The medium in the colours and functions of the state, if they differ. */
  private setAppearances(): void {
    const { state, texels } = this;
    if (state === null || texels === null) return;
    const appearances = texels.channels.map((id) => this.volumes.appearances.of(state, id));
    const { density } = state.trace;
    const { brickTile } = this;
    if (brickTile !== null && showsBelow(brickTile, appearances)) {
      this.loadFiles(); // what bricks leave out may show
      return;
    }
    const dressed = JSON.stringify([appearances.map(({ color }) => color), density]);
    const tables = appearances.map(({ table }) => table.join()).join();
    const tables2d = appearances.map(({ table2d }) => table2d ?? null);
    const isSame = tables2d.every((table2d, c) => table2d === (this.tables2d[c] ?? null));
    if (dressed + tables !== this.dressed || !isSame)
      this.tracer?.setAppearances(appearances, state.trace);
    else if (this.settings === null || gathersAnew(this.settings, state.trace)) {
      this.tracer?.restart();
    }
    this.dressed = dressed + tables;
    this.tables2d = tables2d;
    this.settings = state.trace;
  }

  dispose(): void {
    this.drop();
    this.loader.dispose();
    this.isDisposed = true;
    this.tracer?.dispose();
    this.overlay?.dispose();
  }
}
