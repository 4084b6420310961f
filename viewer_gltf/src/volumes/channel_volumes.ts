/** The bundle's volumes of each channel: the source for each tile, and the transfer functions. */
import type { Bundle } from "../bundle/load";
import { loadVolumes } from "../bundle/load";
import { loadTransferFunctions, type TransferFunction } from "../voxels/transfer_luts";
import { VolumeSource } from "../voxels/volume_source";

export type ChannelVolumes = Readonly<{
  sources: ReadonlyMap<string, VolumeSource>;
  transferFunctions: ReadonlyMap<string, TransferFunction>;
}>;

/** Loads a channel's list of volumes when it is first needed. */
export class ChannelLists {
  private readonly loaded = new Map<string, ChannelVolumes>();
  private readonly underWay = new Map<string, Promise<void>>();
  private readonly failed = new Set<string>();

  /** @param onChange called when a list is loaded or has failed */
  constructor(
    private readonly bundle: Bundle,
    private readonly onChange: () => void,
    private readonly onError: (error: unknown) => void,
  ) {}

  get isLoading(): boolean {
    return this.underWay.size > 0;
  }

  get(channel: string): ChannelVolumes | undefined {
    return this.loaded.get(channel);
  }

  hasFailed(channel: string): boolean {
    return this.failed.has(channel);
  }

  /** Lets failed lists be loaded again, except those of the given channels. */
  forgetFailed(but: readonly string[] = []): void {
    for (const id of this.failed) if (!but.includes(id)) this.failed.delete(id);
  }

  /** Resolves when the list is loaded or has failed; a failure is reported. */
  async load(channel: string): Promise<void> {
    if (this.loaded.has(channel) || this.failed.has(channel)) return;
    let underWay = this.underWay.get(channel);
    if (underWay === undefined) {
      underWay = this.fetch(channel).finally(() => this.underWay.delete(channel));
      this.underWay.set(channel, underWay);
    }
    await underWay;
  }

  private async fetch(id: string): Promise<void> {
    const channel = this.bundle.manifest.channels.find((c) => c.id === id);
    if (channel === undefined) throw new Error(`the bundle has no channel ${id}`);
    try {
      const { base } = this.bundle;
      const [volumes, transferFunctions] = await Promise.all([
        loadVolumes(base, channel.volumes),
        loadTransferFunctions(base, channel),
      ]);
      const sources = new Map(
        [...volumes].map(([tile, volume]) => [tile, new VolumeSource(base, volume)]),
      );
      this.loaded.set(id, { sources, transferFunctions });
    } catch (error) {
      this.failed.add(id);
      this.onError(error);
    }
    this.onChange();
  }
}
