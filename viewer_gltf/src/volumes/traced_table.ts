/**
 * A channel's table for path tracing and for the march that stands in while the view moves. Both
 * use the same table, so that they show the same matter. Plain arrays.
 */
import type { TraceSettings } from "../state/path_trace_settings";
import { ENTRIES } from "../voxels/transfer_luts";
import { envelopeOf, type TransferTable2d } from "../voxels/transfer_table_2d";

type Shift = Pick<TraceSettings, "bias" | "threshold">;

/**
 * Returns the table with its settings applied.
 *
 * @param table RGBA, rows of 256 entries
 * @param bias number that is added to an intensity, 0..1, before its colour and opacity are looked
 * up
 * @param threshold share of the intensities below which voxels are empty
 */
export function tracedTable<T extends Uint8Array>(table: T, { bias, threshold }: Shift): T {
  if (bias === 0 && threshold === 0) return table;
  const shifted = table.slice() as T;
  const last = ENTRIES - 1;
  for (let row = 0; row < table.length; row += 4 * ENTRIES) {
    for (let i = 0; i < ENTRIES; i++) {
      const at = Math.min(last, Math.max(0, i + bias * last));
      const left = Math.min(last - 1, Math.floor(at));
      for (let k = 0; k < 4; k++) {
        const from = row + 4 * left + k;
        shifted[row + 4 * i + k] = Math.round(
          table[from] + (table[from + 4] - table[from]) * (at - left),
        );
      }
      if (i < threshold * last) shifted[row + 4 * i + 3] = 0;
    }
  }
  return shifted;
}

/** The last result for each table, so that callers get the same object again. */
const SHIFTED = new WeakMap<TransferTable2d, Shift & Readonly<{ table: TransferTable2d }>>();

export function tracedTable2d(table: TransferTable2d, shift: Shift): TransferTable2d {
  const { bias, threshold } = shift;
  if (bias === 0 && threshold === 0) return table;
  const made = SHIFTED.get(table);
  if (made?.bias === bias && made.threshold === threshold) return made.table;
  const cells = tracedTable(table.cells, shift);
  const shifted = { ...table, cells, envelope: envelopeOf(cells) };
  SHIFTED.set(table, { bias, threshold, table: shifted });
  return shifted;
}
