/**
 * Loads the two-dimensional transfer functions of a bundle. The shapes are fetched when one is
 * drawn or edited, the histogram when it is shown.
 */

import type { FileRef } from "../bundle/generated/bundle";
import type { Bundle } from "../bundle/load";
import { loadHistogram, loadTransfer2d } from "../bundle/load";
import type { Transfer2d } from "../bundle/transfer_2d";
import type { Histogram } from "../panel/controls";

export class TransferFunctions2dLoader {
  private readonly refs = new Map<string, FileRef>();
  private readonly histograms = new Map<string, Histogram>();
  private readonly loading = new Set<string>();
  /** Keys that failed, which was reported. They are not tried again until `retryFailed`. */
  private readonly failed = new Set<string>();

  constructor(
    private readonly bundle: Bundle,
    private readonly onFunctions: (channel: string, transfer2d: Transfer2d) => void,
    private readonly onChange: () => void,
    private readonly onError: (error: unknown) => void,
  ) {}

  get isLoading(): boolean {
    return this.loading.size > 0;
  }

  /** Fetches the functions of a channel, unless that has been done. */
  want(channel: string): void {
    if (this.refs.has(channel)) return;
    void this.once(channel, async () => {
      const { file } = this.channel(channel).transfer_functions_2d;
      const { histogram, most: _, ...transfer2d } = await loadTransfer2d(this.bundle.base, file);
      this.refs.set(channel, histogram);
      this.onFunctions(channel, transfer2d);
    });
  }

  /** Returns the histogram; null: not loaded yet, so it is fetched. */
  histogram(channel: string): Histogram | null {
    const found = this.histograms.get(channel);
    if (found !== undefined) return found;
    this.want(channel);
    const ref = this.refs.get(channel);
    if (ref === undefined) return null;
    void this.once(ref.path, async () => {
      const cells = await loadHistogram(this.bundle.base, ref);
      this.histograms.set(channel, { cells, toJSON: () => ref.path });
    });
    return null;
  }

  retryFailed(): void {
    this.failed.clear();
  }

  private channel(id: string) {
    const channel = this.bundle.manifest.channels.find((each) => each.id === id);
    if (channel === undefined) throw new Error(`the bundle has no channel ${id}`);
    return channel;
  }

  private async once(key: string, load: () => Promise<void>): Promise<void> {
    if (this.loading.has(key) || this.failed.has(key)) return;
    this.loading.add(key);
    try {
      await load();
    } catch (error) {
      this.failed.add(key);
      this.onError(error);
    } finally {
      this.loading.delete(key);
      this.onChange();
    }
  }
}
