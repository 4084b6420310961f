/**
 * The GPU texture of one tile: up to four channels side by side. A coarse mip level is shown first,
 * and finer ones fade in as they arrive. If other channels are wanted, the texture is replaced at
 * once.
 */
import type { Data3DTexture } from "three";
import { DecodeError, decodeVolume } from "../bundle/decode";
import type { LoadQueue } from "./load_queue";
import { texels } from "./mip_levels";
import type { VolumeSource } from "./volume_source";
import { stride, volumeTexture } from "./volume_texture";

export const LEVEL_FADE_S = 0.2;

/** A loaded mip level: its texture, and the channels in their order in the texture. */
export type Packed = Readonly<{
  channels: readonly string[];
  level: number;
  texture: Data3DTexture;
  /** Position of each brick, if the texture is an atlas of bricks; see bricks/brick_atlas.ts. */
  index: Data3DTexture | null;
  /** Smallest and largest intensity of each brick of each channel, interleaved. */
  bricks: readonly Uint8Array[];
  /** `cellRanges` of each channel at this level; null for an atlas, whose bricks change. */
  cells: readonly Uint8Array[] | null;
}>;

export class TileTexture {
  /** The newest texture; null until the first one is loaded. */
  shown: Packed | null = null;
  /** The texture that `shown` replaces, while it fades in. */
  old: Packed | null = null;
  /** Weight of `shown` while it fades in over `old`, 0 to 1; 1 when the fade is over. */
  fresh = 1;
  isLoading = false;

  private sources: ReadonlyMap<string, VolumeSource> = new Map();
  private levels: readonly number[] = [];
  /** The finest mip level to show; a finer texture is replaced by it. */
  private finest = 0;
  /**
   * Channels with a fault, which was reported. They are not tried again until they are turned off
   * and on.
   */
  private readonly failed = new Set<string>();
  private isDisposed = false;
  /** The current load; aborted when it is no longer wanted. */
  private loading: Readonly<{
    channels: readonly string[];
    level: number;
    abort: AbortController;
  }> | null = null;

  constructor(
    private readonly queue: LoadQueue,
    private readonly onChange: () => void,
    private readonly onError: (error: unknown) => void,
  ) {}

  /** GPU memory of the tile, bytes. */
  get bytes(): number {
    return [this.shown, this.old].reduce((sum, each) => sum + (each ? sizeOf(each) : 0), 0);
  }

  /** Sources of the channels that are wanted, or were wanted last. */
  get kept(): ReadonlyMap<string, VolumeSource> {
    return this.sources;
  }

  hasFailed(channel: string): boolean {
    return this.failed.has(channel);
  }

  /** Lets failed channels be loaded again by the next `want`. */
  retryFailed(): void {
    this.failed.clear();
  }

  /** Loads these channels and mip levels, given coarse to fine; loaded levels are kept. */
  want(sources: ReadonlyMap<string, VolumeSource>, levels: readonly number[], finest = 0): void {
    for (const [id, source] of this.sources) {
      if (sources.get(id) === source) continue;
      this.failed.delete(id);
      source.release();
    }
    this.sources = sources;
    this.levels = levels;
    this.finest = finest;
    if (this.loading !== null) {
      const { channels, level, abort } = this.loading;
      const isOf = levels.includes(level) || level === finest;
      if (!same(channels, this.wanted) || !isOf || levels.length === 0) abort.abort();
    }
    if (!this.isLoading) void this.run();
  }

  /** Advances the fade. Returns whether it is still going on. */
  advance(dt_s: number): boolean {
    if (this.old === null) return false;
    this.fresh = Math.min(1, this.fresh + dt_s / LEVEL_FADE_S);
    if (this.fresh === 1) this.forgetOld();
    return this.old !== null;
  }

  private get wanted(): readonly string[] {
    return [...this.sources.keys()].filter((id) => !this.failed.has(id));
  }

  private async run(): Promise<void> {
    this.isLoading = true;
    for (;;) {
      const channels = this.wanted;
      if (channels.length === 0) this.replace(null);
      const level = this.nextLevel(channels);
      if (level === null) break;
      const abort = new AbortController();
      this.loading = { channels, level, abort };
      const packed = await this.load(channels, level, abort.signal);
      this.loading = null;
      if (this.isDisposed) {
        packed?.texture.dispose();
        return;
      }
      if (packed === null) continue; // aborted, or a channel failed and is left out
      if (same(channels, this.wanted)) {
        this.replace(packed);
        this.onChange();
      } else {
        packed.texture.dispose();
      }
    }
    this.isLoading = false;
    this.onChange();
  }

  private nextLevel(channels: readonly string[]): number | null {
    if (channels.length === 0) return null;
    const { shown } = this;
    if (shown !== null && same(shown.channels, channels)) {
      if (this.levels.length > 0 && this.finest > shown.level) return this.finest;
      return this.levels.find((index) => index < shown.level) ?? null;
    }
    // the finest mip level of which all channels are loaded; if there is none, the first level of
    // the list
    const isHere = (index: number) =>
      channels.every((id) => this.sources.get(id)?.has(index) === true);
    return [...this.levels].reverse().find(isHere) ?? this.levels[0] ?? null;
  }

  /** Loads one mip level of all channels. Returns null if one of them failed, which is reported. */
  private async load(
    channels: readonly string[],
    level: number,
    signal: AbortSignal,
  ): Promise<Packed | null> {
    const parts = await Promise.all(channels.map((id) => this.fetch(id, level, signal)));
    if (signal.aborted || parts.includes(null)) return null;
    const whole = parts.flatMap((part) => (part === null ? [] : [part]));
    const [{ source }] = whole;
    const { size } = source.volume.levels[level];
    const frames = whole.map((each) => ({
      bytes: each.frame,
      name: `${each.source.volume.file.path}: level ${level}`,
    }));
    let decoded: Awaited<ReturnType<typeof decodeVolume>>;
    try {
      decoded = await decodeVolume(frames, size);
    } catch (error) {
      if (!(error instanceof DecodeError)) throw error;
      this.failed.add(channels[error.part]);
      this.onError(error);
      return null;
    }
    const texture = volumeTexture(decoded.texels, size, channels.length);
    const bricks = whole.map((each) => each.bricks);
    return { channels, level, texture, index: null, bricks, cells: decoded.cells };
  }

  private async fetch(id: string, level: number, signal: AbortSignal) {
    const source = this.sources.get(id);
    if (source === undefined) return null;
    try {
      const bricks = await this.queue.add(0, signal, () => source.bricks(signal));
      const cost = texels(source.volume.levels[level]);
      const frame = await this.queue.add(cost, signal, () => source.level(level, signal));
      return { source, bricks, frame };
    } catch (error) {
      if (signal.aborted) return null;
      this.failed.add(id);
      this.onError(error);
      return null;
    }
  }

  private replace(packed: Packed | null): void {
    this.forgetOld();
    const before = this.shown;
    this.shown = packed;
    if (before === null) return;
    if (packed !== null && same(packed.channels, before.channels)) {
      this.old = before;
      this.fresh = 0;
    } else {
      before.texture.dispose();
    }
  }

  private forgetOld(): void {
    this.old?.texture.dispose();
    this.old = null;
    this.fresh = 1;
  }

  dispose(): void {
    this.isDisposed = true;
    this.loading?.abort.abort();
    this.forgetOld();
    this.shown?.texture.dispose();
    this.shown = null;
    for (const source of this.sources.values()) source.release();
  }
}

function sizeOf({ texture, channels }: Packed): number {
  const { width, height, depth } = texture.image;
  return width * height * depth * stride(channels.length);
}

function same(a: readonly string[], b: readonly string[]): boolean {
  return a.length === b.length && a.every((id, i) => id === b[i]);
}
