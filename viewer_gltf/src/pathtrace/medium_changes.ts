/** Detects changes of the medium's appearance or light after which the gathered samples must be dropped. */
import { needsNewPaths, type TraceSettings } from "../state/path_trace_settings";
import type { Appearance } from "../voxels/march_tables";
import type { TransferTable2d } from "../voxels/transfer_table_2d";

export class MediumChanges {
  private appearance = "";
  private tables2d: readonly (TransferTable2d | null)[] = [];
  private settings: TraceSettings | null = null;

  /** Makes the next `since` report a change of appearance, because the texels have changed. */
  forget(): void {
    this.appearance = "";
  }

  /** Returns the change since the last call: of the appearance, of the light alone, or none (null). */
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
