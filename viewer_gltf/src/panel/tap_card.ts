/** The card beside a tapped place, as plain data: the structure there, and what can be done with it. Pure. */
import { toHex } from "../math/color";
import { START_OBJECTS } from "../state/objects";
import { COLOR } from "../state/parameters/channel";
import { REFUSED } from "../state/refusals";
import { tileTitle } from "../state/tile_name";
import type { ChannelState, ViewerState } from "../state/viewer_state";
import { colourOf } from "./control_templates";
import type { Button, Control, Request } from "./controls";
import { labelMapsOf, objectsSection } from "./layout";
import { freeColours, nameOfColour } from "./palettes";

/** The tile, channel and object that a ray from a tap meets. */
export type Tapped = Readonly<{
  tile: string;
  /**
   * The channel of which something is shown at the tapped point; null: the point is inside a tile,
   * but nothing is shown there.
   */
  channel: string | null;
  /** An object of a label map: its row in the table, and its name. */
  object?: Readonly<{ row: number; name: string }>;
}>;

export type TapCardContent = Readonly<{
  title: string;
  /**
   * Second line of the card: channel and tile of the tapped point, if the title does not name them;
   * may be "".
   */
  subtitle: string;
  controls: readonly Control[];
}>;

/** @param undo the change that undo would take back, in words; null: none */
export function tapCardOf(
  state: ViewerState,
  { tile, channel: id, object }: Tapped,
  undo: string | null,
): TapCardContent {
  const channel = state.channels.find((each) => each.id === id);
  const place = state.tiles.length > 1 ? tileTitle(tile, state.tiles) : "";
  const titles = [object?.name, channel?.name, place].filter((each) => each !== undefined);
  const [title, ...rest] = titles.filter((each) => each !== "");
  const controls = [
    ...(object === undefined || channel === undefined
      ? []
      : objectControls(state, channel.id, object.row)),
    ...tileControls(state, tile),
    ...(channel === undefined ? [] : channelControls(state, channel)),
    undoButton(undo),
  ];
  return { title: title ?? "Nothing is shown here", subtitle: rest.join(" · "), controls };
}

function button(id: string, label: string, request: Request): Button {
  return { kind: "button", id: `tap-${id}`, label, to: () => request };
}

function tileControls({ tiles, isolated }: ViewerState, tile: string): readonly Control[] {
  if (tiles.length < 2) return [];
  return isolated === null
    ? [button("isolate", "Show only this tile", { type: "isolate", tile })]
    : [button("isolate", "Show all tiles", { type: "isolate", tile: null })];
}

function channelControls(state: ViewerState, channel: ChannelState): readonly Control[] {
  const { id, name, shown } = channel;
  const hide = button("hide", `${shown ? "Hide" : "Show"} ${name}`, {
    type: "show",
    channel: id,
    shown: !shown,
  });
  // colours by a column replace the colour of the channel
  const isPlain = !channel.hasObjects || state.objects[id]?.colorBy === "";
  return shown && isPlain ? [hide, coloursOf(state, channel)] : [hide];
}

/** Offers eight colours that no other channel has. */
function coloursOf({ channels }: ViewerState, channel: ChannelState): Control {
  const others = channels.filter(({ id }) => id !== channel.id).map(({ color }) => toHex(color));
  const colors = freeColours(others).map((hex) => ({ hex, name: nameOfColour(hex) }));
  return {
    ...colourOf(COLOR, channel, channel.id),
    id: "tap-colour",
    label: `Colour of ${channel.name}`,
    palettes: [{ name: `Colour of ${channel.name}`, colors }],
  };
}

function objectControls(state: ViewerState, channel: string, row: number): readonly Control[] {
  const { only, hidden } = state.objects[channel] ?? START_OBJECTS;
  const change = (change: Partial<typeof START_OBJECTS>): Request => ({
    ...{ type: "objects", channel, change },
  });
  const section = objectsSection(channel, labelMapsOf(state).length);
  const isHidden = hidden.includes(row);
  const left = hidden.filter((each) => each !== row);
  return [
    only === null
      ? button("only-object", "Show only this object", change({ only: [row] }))
      : button("only-object", "Show all objects", change({ only: null })),
    isHidden
      ? button("hide-object", "Show this object", change({ hidden: left }))
      : button("hide-object", "Hide this object", change({ hidden: [...hidden, row] })),
    button("values", "Values of this object", {
      ...{ panel: "reveal", section, control: `${channel}/objects-card` },
    }),
  ];
}

function undoButton(undo: string | null): Control {
  return {
    ...button("undo", undo === null ? "Undo" : `Undo: ${undo}`, "undo"),
    isStep: true,
    refusal: undo === null ? REFUSED.undo : "",
  };
}
