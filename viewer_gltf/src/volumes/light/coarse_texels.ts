/**
 * Texels of coarse mip levels for the shading, decoded again from levels that are already loaded.
 */
import { DecodeError, decodeTexels } from "../../bundle/decode";
import { texels } from "../../voxels/mip_levels";
import type { VolumeSource } from "../../voxels/volume_source";

type Kept = { level: number; texels: Uint8Array | null };

export class CoarseTexels {
  private readonly kept = new Map<VolumeSource, Kept>();
  private underWay = 0;

  constructor(
    private readonly onChange: () => void,
    private readonly onError: (error: unknown) => void,
  ) {}

  get isLoading(): boolean {
    return this.underWay > 0;
  }

  /** The texels of a loaded mip level; null until `onChange` is called, or if decoding fails. */
  get(source: VolumeSource, level: number): Uint8Array | null {
    const kept = this.kept.get(source);
    if (kept?.level === level) return kept.texels;
    const entry: Kept = { level, texels: null };
    this.kept.set(source, entry);
    void this.decode(source, entry);
    return null;
  }

  keep(sources: ReadonlySet<VolumeSource>): void {
    for (const source of this.kept.keys()) if (!sources.has(source)) this.kept.delete(source);
  }

  private async decode(source: VolumeSource, entry: Kept): Promise<void> {
    this.underWay++;
    try {
      const { levels, file } = source.volume;
      const bytes = await source.level(entry.level, new AbortController().signal);
      const name = `${file.path}: level ${entry.level}`;
      entry.texels = await decodeTexels([{ bytes, name }], texels(levels[entry.level]));
    } catch (error) {
      if (!(error instanceof DecodeError)) throw error;
      this.onError(error); // the file is not damaged, because this mip level was drawn before
    } finally {
      this.underWay--;
    }
    this.onChange();
  }
}
