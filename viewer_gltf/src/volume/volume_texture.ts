/** The GPU texture of one (tile, channel): coarse first, replaced as finer levels arrive. */
import {
  ClampToEdgeWrapping,
  Data3DTexture,
  LinearFilter,
  RedFormat,
  UnsignedByteType,
} from "three";
import { fetchFile } from "../bundle/fetch";
import { readLevel, readTexture, type Size3 } from "./ktx2";
import { texels } from "./levels";
import type { LoadQueue } from "./queue";
import type { VolumeSource } from "./source";

export class VolumeTexture {
  /** The finest level so far; null until the first has arrived. */
  texture: Data3DTexture | null = null;
  level = Number.POSITIVE_INFINITY;
  /** Smallest and largest intensity of every brick, interleaved. */
  bricks: Uint8Array | null = null;
  isLoading = false;

  /** After a fault, which was told, nothing is tried again until the volume is turned on anew. */
  private hasFailed = false;
  private wanted: readonly number[] = [];
  private readonly abort = new AbortController();

  constructor(
    readonly source: VolumeSource,
    private readonly base: string,
    private readonly queue: LoadQueue,
    private readonly onChange: () => void,
    private readonly onError: (error: unknown) => void,
  ) {}

  get brickCount(): Size3 {
    const [x, y, z] = this.source.volume.size;
    return [Math.ceil(x / 8), Math.ceil(y / 8), Math.ceil(z / 8)];
  }

  /** Load these levels, given coarse to fine; what is there already is kept. */
  want(levels: readonly number[]): void {
    this.wanted = levels;
    if (!this.isLoading && !this.hasFailed) void this.run();
  }

  private async run(): Promise<void> {
    this.isLoading = true;
    try {
      if (this.bricks === null) await this.loadBricks();
      for (;;) {
        const next = this.wanted.find((index) => index < this.level);
        if (next === undefined) break;
        await this.loadLevel(next);
      }
    } catch (error) {
      this.hasFailed = true;
      if (!this.abort.signal.aborted) this.onError(error);
    } finally {
      this.isLoading = false;
      if (!this.abort.signal.aborted) this.onChange();
    }
  }

  private async loadBricks(): Promise<void> {
    const { path } = this.source.volume.bricks;
    const { signal } = this.abort;
    const file = await this.queue.add(0, signal, () =>
      fetchFile(this.base, this.source.volume.bricks, signal),
    );
    const texture = readTexture(file, path, "R8G8", this.brickCount);
    this.bricks = await readLevel(texture, path, "R8G8", 0);
  }

  private async loadLevel(index: number): Promise<void> {
    const level = this.source.volume.levels[index];
    const { signal } = this.abort;
    const data = await this.queue.add(texels(level), signal, () =>
      this.source.fetchLevel(index, signal),
    );
    signal.throwIfAborted();
    const texture = new Data3DTexture(data, ...level.size);
    texture.format = RedFormat;
    texture.type = UnsignedByteType;
    texture.minFilter = LinearFilter;
    texture.magFilter = LinearFilter;
    texture.wrapS = texture.wrapT = texture.wrapR = ClampToEdgeWrapping;
    texture.unpackAlignment = 1;
    texture.needsUpdate = true;
    // The texels need not stay in memory once the GPU has them.
    texture.onUpdate = () => {
      texture.image.data = null;
      texture.onUpdate = null;
    };
    this.texture?.dispose();
    this.texture = texture;
    this.level = index;
    this.onChange();
  }

  dispose(): void {
    this.abort.abort();
    this.texture?.dispose();
    this.texture = null;
  }
}
