/** How each channel's volumes look: its colour, and its opacity by value. */
import type { Shapes, Transfer2d } from "../bundle/transfer_2d";
import { isTraced } from "../state/parameters/volumes";
import { isInDisc } from "../state/representation";
import { isTwoD, shapesOf } from "../state/transfer_functions_2d";
import type { ChannelState, ViewerState } from "../state/viewer_state";
import { BrickTile } from "./bricks/brick_atlas";
import type { ChannelLists } from "./channel_volumes";
import { type Appearance, floorOf } from "./tile_raymarch";
import type { TileTexture } from "./tile_texture";
import { tracedTable, tracedTable2d } from "./traced_table";
import { lookUpTable } from "./transfer_luts";
import { NO_ENTRIES, type TransferTable2d, transferTable2d } from "./transfer_table_2d";

type MadeTable2d = Readonly<{
  shapes: Shapes;
  transfer2d: Transfer2d;
  window: readonly [number, number];
  opacity: number;
  table: TransferTable2d;
}>;

export class Appearances {
  /** The last table of each channel: all tiles ask for the same. */
  private readonly tables2d = new Map<string, MadeTable2d>();

  constructor(private readonly channels: ChannelLists) {}

  /** The appearance of a channel. The channel's list must have come. */
  of(state: ViewerState, id: string): Appearance {
    const appearance = this.ownAppearance(state, id);
    if (!isTraced(state)) return appearance;
    const { trace } = state;
    const { table2d } = appearance;
    if (table2d == null) return { ...appearance, table: tracedTable(appearance.table, trace) };
    const shifted = tracedTable2d(table2d, trace);
    return { ...appearance, table2d: shifted, table: shifted.envelope };
  }

  /** Its appearance by its transfer function alone. */
  private ownAppearance(state: ViewerState, id: string): Appearance {
    const channel = state.channels.find((c) => c.id === id);
    const volumes = this.channels.get(id);
    if (channel === undefined || volumes === undefined) {
      throw new Error(`channel ${id} has come without a look`);
    }
    const table2d = this.table2dOf(channel);
    if (table2d !== null) {
      const { color } = channel;
      const { window } = channel;
      const table = table2d.envelope;
      return { color, table, table2d, window, isInDisc: isInDisc(state, channel) };
    }
    const { transferFunction: name } = channel;
    // one's own function has no one-dimensional one that stands for it
    const entries =
      volumes.transferFunctions.get(name) ?? (isTwoD(channel) ? NO_ENTRIES : undefined);
    if (entries === undefined) throw new Error(`no transfer function ${name}`);
    return {
      color: channel.color,
      table: lookUpTable(entries, channel.window, channel.opacity),
      window: channel.window,
      isInDisc: isInDisc(state, channel),
    };
  }

  /** The table of a two-dimensional function, as soon as its shapes have come. */
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

/** Whether functions show what bricks leave out. */
export function showsBelow(
  texture: TileTexture | BrickTile,
  appearances: readonly Appearance[],
): boolean {
  if (!(texture instanceof BrickTile)) return false;
  const { thresholds } = texture;
  return appearances.some(({ table }, c) => Math.round(255 * floorOf(table)) < thresholds[c]);
}
