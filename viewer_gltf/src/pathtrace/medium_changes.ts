/** Whether another appearance of the medium, or another light on it, makes the gathered light worthless. */
import { needsNewPaths, type TraceSettings } from "../state/path_trace_settings";
import type { Appearance } from "../voxels/march_tables";
import type { TransferTable2d } from "../voxels/transfer_table_2d";

export class MediumChanges {
  private appearance = "";
  private tables2d: readonly (TransferTable2d | null)[] = [];
  private settings: TraceSettings | null = null;

  /** The medium itself is another one. */
  forget(): void {
    this.appearance = "";
  }

  /** Return what has to be done since the last call: give the medium its appearance, gather again, or nothing. */
  since(
    appearances: readonly Appearance[],
    settings: TraceSettings,
  ): "appearance" | "light" | null {
    const colors = JSON.stringify([appearances.map(({ color }) => color), settings.density]);
    const appearance = colors + appearances.map(({ table }) => table.join()).join();
    const tables2d = appearances.map(({ table2d }) => table2d ?? null);
    const isSame =
      appearance === this.appearance &&
      tables2d.every((table2d, c) => table2d === (this.tables2d[c] ?? null));
    const before = this.settings;
    this.appearance = appearance;
    this.tables2d = tables2d;
    this.settings = settings;
    if (!isSame) return "appearance";
    return before === null || needsNewPaths(before, settings) ? "light" : null;
  }
}
