/**
 * A channel's table as paths of light look it up, and the march that stands in for them while the view moves:
 * one table for both, so that they can't show different matter. Pure arrays.
 */
import type { TraceSettings } from "../state/path_trace_settings";
import { ENTRIES } from "../voxels/transfer_luts";
import { envelopeOf, type TransferTable2d } from "../voxels/transfer_table_2d";

type Shift = Pick<TraceSettings, "bias" | "threshold">;

/**
 * @param table RGBA, rows of 256 entries
 * @param bias a grey value is as opaque as another one, which is brighter by so much of all intensities
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

/** The last shift of each table: callers know a table again by its identity. */
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
