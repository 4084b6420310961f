/**
 * The images of the three slices. The texels of the shown tiles are fetched, coarse ones first, then resampled and
 * coloured. The page and the scene show the same canvases.
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

/** Length of an image's longer edge, pixels. */
const LONGEST_PX = 384;
/** Largest number of texels that are fetched for all tiles and channels together. */
const MAX_TEXELS = 40 * 1024 * 1024;
/** Largest number of texels of one tile in the first, coarse fetch. */
const FIRST_TEXELS = 48 ** 3;

export type SlicesOptions = Readonly<{
  manifest: Manifest;
  /** Address of the bundle's manifest. */
  base: string;
  /** The measured values of voxels; null: the host does not offer them. */
  values: ValuesHost | null;
  sourceOf: (tile: string, channel: string) => Promise<LevelSource | null>;
  /** Called when the frame has to be drawn again. */
  onChange: () => void;
  onError: (error: unknown) => void;
  /** Called after the images have been drawn again. */
  onPaint: () => void;
}>;

type Layer = Readonly<{ channel: ChannelState; blocks: readonly TexelBlock[] }>;

export class SliceImages {
  /** Geometry of the slices; null: none are shown. */
  frames: readonly SliceFrame[] | null = null;
  /** The point where the slices meet, um. */
  point: Vec3 = [0, 0, 0];
  /** Box of the specimen, or of the isolated tile, um. */
  box: Box;
  readonly canvases = AXES.map(() => document.createElement("canvas"));
  /**
   * Number of times that the images have been drawn. Owners of copies compare it to notice new
   * content.
   */
  version = 0;
  isLoading = false;
  /** Whether texels have loaded; until then the images are black. */
  hasLoaded = false;
  private readonly cache: TexelCache;
  private state: ViewerState | null = null;
  private layers: readonly Layer[] = [];
  /** Keys of the texels that are loaded, of the planes that are resampled, and of the colours that are drawn. */
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

  sync(state: ViewerState): void {
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

  /** Names and values of the loaded channels at a point in um, in the source's units. */
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

  /** Resolves when `valuesAt` knows the measured values at a point; null: the host does not offer measured values. */
  measureAt(point: Vec3): Promise<unknown> | null {
    const { values } = this.options;
    if (values === null) return null;
    const asked = this.layers.flatMap(({ channel, blocks }) =>
      blocks.flatMap(({ volume }) => {
        const voxel = volume.measured === undefined ? null : voxelAt(volume, point);
        return voxel === null ? [] : [values.ask(volume.tile, channel.id, voxel)];
      }),
    );
    return Promise.allSettled(asked); // a channel whose request fails keeps its value of 8 bits
  }

  retryFailed(): void {
    this.loaded = "";
    if (this.state !== null) this.sync(this.state);
  }

  /** Draws and loads in the next task, once for all changes until then. */
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
        if (this.isDisposed || wanted !== this.loaded) return; // other channels or tiles are shown by now
        this.layers = layers;
        this.hasLoaded = true;
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
