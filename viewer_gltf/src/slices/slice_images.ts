/**
 * The pictures of the three slice planes: texels of the tiles that a plane cuts are fetched, coarse ones
 * first, resampled and coloured. Page and scene show the same canvases.
 */

import type { Manifest } from "../bundle/generated/bundle";
import type { ValuesHost } from "../bundle/values_host";
import type { Box } from "../math/box";
import { shownBox, shownTiles } from "../math/pick";
import { AXES, type Vec3 } from "../math/vec3";
import { measuredText, unitOf, valueAt, valueText, voxelAt } from "../probe/measure";
import { TexelCache } from "../probe/texel_cache";
import type { LevelSource } from "../state/on_screen";
import type { ChannelState, ViewerState } from "../state/viewer_state";
import { VolumeSource } from "../voxels/volume_source";
import { compose, GREY, reslice, type Size, sizeOf, type TexelBlock } from "./reslice";
import { isSliced } from "./settings";
import { outlineOf, pointAt, type SliceFrame, sliceFrames } from "./slice_frame";

/** Pixels of a picture's longer edge. */
const LONGEST_PX = 384;
/** Most texels of all tiles and channels together that are looked up. */
const MAX_TEXELS = 40 * 1024 * 1024;
/** Most texels of one tile that come before any other. */
const FIRST_TEXELS = 48 ** 3;

export type SlicesOptions = Readonly<{
  manifest: Manifest;
  /** Address of the bundle's manifest. */
  base: string;
  /** Voxels as they were measured; null: the host has none. */
  values: ValuesHost | null;
  sourceOf: (tile: string, channel: string) => Promise<LevelSource | null>;
  /** The pictures differ now. */
  onChange: () => void;
  onError: (error: unknown) => void;
  /** Called with every new picture. */
  onPaint: () => void;
}>;

type Layer = Readonly<{ channel: ChannelState; blocks: readonly TexelBlock[] }>;

export class SliceImages {
  /** null: none are shown. */
  frames: readonly SliceFrame[] | null = null;
  /** Where the planes meet. */
  point: Vec3 = [0, 0, 0];
  /** What they are cut from: the specimen, or the only tile. */
  box: Box;
  readonly canvases = AXES.map(() => document.createElement("canvas"));
  /** Changes with every picture. */
  version = 0;
  isLoading = false;
  /** Whether there is anything to cut: until then the pictures are black. */
  hasCome = false;
  private readonly cache: TexelCache;
  private state: ViewerState | null = null;
  private layers: readonly Layer[] = [];
  /** What has been loaded, and what has been resampled and drawn of it. */
  private loaded = "";
  private sampled = "";
  private drawn = "";
  private values: readonly (readonly Float32Array[])[] = [];
  private timer = 0;
  private isDisposed = false;

  constructor(private readonly options: SlicesOptions) {
    this.cache = new TexelCache((volume) => new VolumeSource(options.base, volume));
    this.box = options.manifest.specimen.bounds_um;
  }

  follow(state: ViewerState): void {
    this.state = state;
    if (!isSliced(state)) {
      this.frames = null;
      return;
    }
    const { manifest } = this.options;
    const { bounds_um, sides } = manifest.specimen;
    this.box = shownBox(manifest, state.isolated);
    this.point = pointAt([state.sliceX, state.sliceY, state.sliceZ], bounds_um);
    const turn_deg: Vec3 = [state.sliceTurnX_deg, state.sliceTurnY_deg, state.sliceTurnZ_deg];
    this.frames = sliceFrames({ point: this.point, turn_deg }, this.box, sides ?? null);
    this.update();
  }

  /** Names and values of the shown channels at a point, in the source's units. */
  valuesAt(point: Vec3): readonly string[] {
    const { manifest, values } = this.options;
    const unit = unitOf(manifest);
    return this.layers.flatMap(({ channel, blocks }) => {
      const window = manifest.channels.find(({ id }) => id === channel.id)?.window;
      if (window === undefined) return [];
      for (const { volume, level } of blocks) {
        const value = valueAt(volume, level, window, point);
        if (value === null) continue;
        const voxel = voxelAt(volume, point);
        const measured = voxel && values?.known(volume.tile, channel.id, voxel);
        const text =
          measured == null ? valueText(value, window, unit) : measuredText(measured, unit);
        return [`${channel.name} ${text}`];
      }
      return [];
    });
  }

  /** Resolves when `valuesAt` has what was measured at a point; null: the host has no such values. */
  measureAt(point: Vec3): Promise<unknown> | null {
    const { values } = this.options;
    if (values === null) return null;
    const asked = this.layers.flatMap(({ channel, blocks }) =>
      blocks.flatMap(({ volume }) => {
        const voxel = volume.measured === undefined ? null : voxelAt(volume, point);
        return voxel === null ? [] : [values.ask(volume.tile, channel.id, voxel)];
      }),
    );
    return Promise.allSettled(asked); // without an answer the value of 8 bits stays
  }

  retryFailed(): void {
    this.loaded = "";
    if (this.state !== null) this.follow(this.state);
  }

  /** Draw by the end of this turn, whatever has changed until then. */
  private update(): void {
    if (this.timer !== 0) return;
    this.timer = window.setTimeout(() => {
      this.timer = 0;
      if (this.isDisposed || this.frames === null) return;
      this.draw();
      void this.load();
    });
  }

  private async load(): Promise<void> {
    const { state } = this;
    if (state === null) return;
    const shown = state.channels.filter((channel) => channel.shown);
    const tiles = shownTiles(this.options.manifest.tiles, state.isolated);
    const wanted = `${shown.map(({ id }) => id)} ${tiles.map(({ id }) => id)}`;
    if (wanted === this.loaded) return;
    this.loaded = wanted;
    this.isLoading = true;
    const most = MAX_TEXELS / Math.max(1, shown.length * tiles.length);
    try {
      for (const texels of [Math.min(FIRST_TEXELS, most), most]) {
        const layers = await Promise.all(
          shown.map(async (channel) => ({
            channel,
            blocks: (
              await Promise.all(tiles.map(({ id }) => this.block(id, channel.id, texels)))
            ).flatMap((block) => block ?? []),
          })),
        );
        if (this.isDisposed || wanted !== this.loaded) return; // something else is wanted by now
        this.layers = layers;
        this.hasCome = true;
        this.sampled = "";
        this.draw();
      }
    } catch (error) {
      if (!this.isDisposed) this.options.onError(error);
    } finally {
      if (wanted === this.loaded) this.isLoading = false;
      if (!this.isDisposed) this.options.onChange();
    }
  }

  private async block(tile: string, channel: string, most: number): Promise<TexelBlock | null> {
    const source = await this.options.sourceOf(tile, channel);
    if (source === null) return null;
    return { volume: source.volume, level: await this.cache.within(source, most) };
  }

  private draw(): void {
    const { frames, state, layers } = this;
    if (frames === null || state === null) return;
    const cut = JSON.stringify(frames);
    const sizes = frames.map((frame) => sizeOf(frame, LONGEST_PX));
    if (cut !== this.sampled) {
      this.sampled = cut;
      this.drawn = "";
      this.values = frames.map((frame, i) => {
        const isMet = outlineOf(frame, this.box).length > 2;
        return layers.map(({ blocks }) => reslice(isMet ? blocks : [], frame, sizes[i]));
      });
    }
    const looks = layers.map(({ channel: { id } }) => {
      const now = state.channels.find((channel) => channel.id === id);
      const color = layers.length === 1 ? GREY : (now?.color ?? GREY);
      return { window: now?.window ?? ([0, 1] as const), color, isShown: now?.shown === true };
    });
    const shades = JSON.stringify(looks);
    if (shades === this.drawn) return;
    this.drawn = shades;
    this.canvases.forEach((canvas, i) => {
      const shown = this.values[i].flatMap((values, k) =>
        looks[k].isShown ? [{ values, look: looks[k] }] : [],
      );
      paint(canvas, sizes[i], shown);
    });
    this.version++;
    this.options.onPaint();
    this.options.onChange();
  }

  dispose(): void {
    this.isDisposed = true;
    clearTimeout(this.timer);
    this.cache.dispose();
  }
}

function paint(
  canvas: HTMLCanvasElement,
  { width, height }: Size,
  layers: Parameters<typeof compose>[0],
): void {
  const context = canvas.getContext("2d");
  if (context === null) throw new Error("no 2D canvas");
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  const image = context.createImageData(width, height);
  compose(layers, image.data);
  context.putImageData(image, 0, 0);
}
