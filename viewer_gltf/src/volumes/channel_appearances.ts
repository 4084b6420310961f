/**
 * The appearance of each channel's volumes: colour, window and transfer function from the state.
 */
import type { Shapes, Transfer2d } from "../bundle/transfer_2d";
import { isTraced } from "../state/parameters/volumes";
import { isInDisc } from "../state/representation";
import { isTwoD, shapesOf } from "../state/transfer_functions_2d";
import type { ChannelState, ViewerState } from "../state/viewer_state";
import type { Appearance } from "../voxels/march_tables";
import { lookUpTable } from "../voxels/transfer_luts";
import { NO_ENTRIES, type TransferTable2d, transferTable2d } from "../voxels/transfer_table_2d";
import type { ChannelLists } from "./channel_volumes";
import { tracedTable, tracedTable2d } from "./traced_table";

type MadeTable2d = Readonly<{
  shapes: Shapes;
  transfer2d: Transfer2d;
  window: readonly [number, number];
  opacity: number;
  table: TransferTable2d;
}>;

export class ChannelAppearances {
  /** The last table of each channel, because all tiles ask for the same one. */
  private readonly tables2d = new Map<string, MadeTable2d>();

  constructor(private readonly lists: ChannelLists) {}

  /** The appearance of a channel, whose list must be loaded. */
  of(state: ViewerState, id: string): Appearance {
    const appearance = this.untraced(state, id);
    if (!isTraced(state)) return appearance;
    const { trace } = state;
    const { table2d } = appearance;
    if (table2d == null) return { ...appearance, table: tracedTable(appearance.table, trace) };
    const shifted = tracedTable2d(table2d, trace);
    return { ...appearance, table2d: shifted, table: shifted.envelope };
  }

  /** The appearance of a channel from its transfer function alone, without path tracing. */
  private untraced(state: ViewerState, id: string): Appearance {
    const channel = state.channels.find((each) => each.id === id);
    const volumes = this.lists.get(id);
    if (channel === undefined || volumes === undefined) {
      throw new Error(`the list of volumes of channel ${id} is not loaded`);
    }
    const { color, window, opacity, transferFunction: name } = channel;
    const common = { color, window, isInDisc: isInDisc(state, channel) };
    const table2d = this.table2dOf(channel);
    if (table2d !== null) return { ...common, table: table2d.envelope, table2d };
    // a two-dimensional function of the user's own has no one-dimensional substitute
    const entries =
      volumes.transferFunctions.get(name) ?? (isTwoD(channel) ? NO_ENTRIES : undefined);
    if (entries === undefined) throw new Error(`channel ${id} has no transfer function ${name}`);
    return { ...common, table: lookUpTable(entries, window, opacity) };
  }

  /**
   * The table of a two-dimensional function; null if the function has one dimension or its shapes
   * are not loaded.
   */
  private table2dOf(channel: ChannelState): TransferTable2d | null {
    const { id, transfer2d, window, opacity } = channel;
    const shapes = shapesOf(channel);
    if (transfer2d === null || shapes.length === 0) return null;
    const made = this.tables2d.get(id);
    const isSame =
      made?.shapes === shapes &&
      made.transfer2d === transfer2d &&
      made.window === window &&
      made.opacity === opacity;
    if (isSame) return made.table;
    const table = transferTable2d(shapes, transfer2d, window, opacity);
    this.tables2d.set(id, { shapes, transfer2d, window, opacity, table });
    return table;
  }
}
