/**
 * Loads the texels for path tracing: all tiles of up to four channels in one texture. A coarse mip
 * level is loaded first, and then the finest one that fits into the memory.
 */
import type { Data3DTexture } from "three";
import { decodeTexels } from "../bundle/decode";
import type { Size3 } from "../bundle/ktx2";
import { LoadQueue } from "../voxels/load_queue";
import { levelsToFetch, texels as texelsOf, type VolumeLimits } from "../voxels/mip_levels";
import type { VolumeSource } from "../voxels/volume_source";
import { stride, volumeTexture } from "../voxels/volume_texture";
import { askWorker } from "./ask_worker";
import type { Assembled, AssembleRequest, Part } from "./assemble_tiles";
import { type BlockFrame, frameOf } from "./texel_frame";

const PARALLEL_LOADS = 4;

export type MediumTexels = Readonly<{
  channels: readonly string[];
  frame: BlockFrame;
  level: number;
  /**
   * Size of the block in texels (x, y, z) at the loaded mip level; if bricks are streamed, at the
   * finest level.
   */
  size: Size3;
  texture: Data3DTexture;
  /** Positions of the bricks in the texture; null: the texture is the whole block. */
  index: Data3DTexture | null;
  /** Smallest and largest intensity of every brick of SKIP_BRICK^3 texels, of each channel, interleaved. */
  bricks: readonly Uint8Array[];
  /** Frees the texture. */
  release: () => void;
}>;

/** The volumes of a channel, by tile ID. */
export type ChannelSources = Readonly<{ id: string; tiles: ReadonlyMap<string, VolumeSource> }>;

/**
 * Returns the channels that have volumes of their own. A second surface of a channel shares the volumes of the first
 * one and has none. Channels whose list could not be loaded (null) are left out; their error is already reported.
 */
export const withVolumes = (
  channels: readonly Readonly<{ id: string; tiles: ChannelSources["tiles"] | null }>[],
): readonly ChannelSources[] =>
  channels.flatMap(({ id, tiles }) => (tiles === null || tiles.size === 0 ? [] : [{ id, tiles }]));

export class MediumLoader {
  private readonly queue = new LoadQueue(PARALLEL_LOADS);
  private worker: Worker | null = null;
  private last = 0;

  /**
   * Loads channels of tiles, from coarse to fine, and passes each level to `onLevel`. Throws BundleError if a file is
   * damaged, and AbortError when `signal` is aborted.
   *
   * @param limits largest size of the texture in bytes, and along an edge in texels
   */
  async load(
    channels: readonly ChannelSources[],
    tiles: readonly string[],
    limits: VolumeLimits,
    signal: AbortSignal,
    onLevel: (texels: MediumTexels) => void,
  ): Promise<void> {
    const [first] = channels;
    const volumes = tiles.flatMap((tile) => first.tiles.get(tile)?.volume ?? []);
    if (volumes.length === 0) return;
    const frame = frameOf(volumes);
    const parts = volumes.filter(({ tile }) => frame.places.has(tile));
    const share = limits.bytes / stride(channels.length) / parts.length;
    const isWithin = (level: number) => Math.max(...coarser(frame.size, level)) <= limits.side;
    const wanted = levelsToFetch(parts[0].levels, share, Math.min(limits.side, limits.edge)).filter(
      isWithin,
    );
    const [coarsest = parts[0].levels.length - 1] = wanted;
    for (const level of new Set([coarsest, wanted.at(-1) ?? coarsest])) {
      const made = await Promise.all(
        parts.map(({ tile }) => this.part(channels, tile, level, frame, signal)),
      );
      signal.throwIfAborted();
      const size = coarser(frame.size, level);
      const { texels, bricks } = await this.assemble({
        id: ++this.last,
        size,
        finest: frame.size,
        stride: stride(channels.length),
        channels: channels.length,
        parts: made,
      });
      signal.throwIfAborted();
      const texture = volumeTexture(texels, size, channels.length);
      onLevel({
        channels: channels.map(({ id }) => id),
        frame,
        level,
        size,
        texture,
        index: null,
        bricks,
        release: () => texture.dispose(),
      });
    }
  }

  private async part(
    channels: readonly ChannelSources[],
    tile: string,
    level: number,
    frame: BlockFrame,
    signal: AbortSignal,
  ): Promise<Part> {
    const sources = channels.flatMap(({ tiles }) => tiles.get(tile) ?? []);
    const { volume } = sources[0];
    const at = frame.places.get(tile);
    if (at === undefined || sources.length < channels.length) {
      throw new Error(`tile ${tile} is not in every channel`);
    }
    const cost = texelsOf(volume.levels[level]);
    const frames = await Promise.all(
      sources.map(async (source) => ({
        bytes: await this.queue.add(cost, signal, () => source.level(level, signal)),
        name: `${source.volume.file.path}: level ${level}`,
      })),
    );
    const texels = await decodeTexels(frames, cost);
    return { at, whole: volume.size, size: volume.levels[level].size, texels };
  }

  private assemble(request: AssembleRequest): Promise<Assembled> {
    this.worker ??= new Worker(new URL("./assemble_worker.ts", import.meta.url), {
      type: "module",
    });
    const transfer = request.parts.map((part) => part.texels.buffer);
    return askWorker<Assembled>(this.worker, request, transfer, "tiles can't be put together");
  }

  dispose(): void {
    this.worker?.terminate();
    this.worker = null;
  }
}

function coarser(size: Size3, level: number): Size3 {
  const [x, y, z] = size.map((n) => Math.max(1, n >> level));
  return [x, y, z];
}
