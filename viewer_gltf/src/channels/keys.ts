/** The keys of the channels: which channel they change, and its appearance. Pure. */
import { fromHex, toHex } from "../math/color";
import type { Request } from "../panel/controls";
import {
  type Key,
  type KeyGroup,
  key,
  keysOfChannel,
  neighbour,
  no,
  ofChannel,
  withChannel,
} from "../panel/key";
import { nextFreeColour } from "../panel/palettes";
import { CHANNEL, COLOR, VOLUME } from "../state/parameters/channel";
import { setTo } from "../state/parameters/kinds";
import { REFUSED } from "../state/refusals";
import type { ChannelState } from "../state/viewer_state";
import { pagesOf } from "./section";
import { SHAPE_KEYS } from "./transfer_function_2d_keys";

const WINDOW_STEP = 1 / 64;

function pick(by: number): Key["to"] {
  return ({ state, view }) => {
    const shown = state.channels.filter((each) => each.shown).map(({ id }) => id);
    const channel = neighbour(shown, view.picked ?? undefined, by);
    return channel === null ? no(REFUSED.channel) : { panel: "pick", channel };
  };
}

function shift(low: number, high: number) {
  return ({ id, window }: ChannelState): Request => ({
    type: "window",
    channel: id,
    window: [window[0] + low, window[1] + high],
  });
}

const DIGITS = ["1", "2", "3", "4", "5", "6", "7", "8", "9"] as const;

const KEYS: readonly Key[] = [
  key(DIGITS, "Show or hide this channel of the bundle", ({ state }, name) => {
    const channel = state.channels[Number(name) - 1];
    if (channel === undefined) return no(`This bundle has no channel ${name}.`);
    return { type: "show", channel: channel.id, shown: !channel.shown };
  }),
  key("/", "Find a channel that is not shown", "find"),
  key("A", "Next page of the list of channels", ({ state, view }) => {
    const pages = pagesOf(state, view);
    return pages === 1 ? no(REFUSED.page) : { panel: "page", page: (view.page + 1) % pages };
  }),
  key("c", "Next channel, which the keys below change", pick(1)),
  key("C", "Previous channel", pick(-1)),
  ofChannel("x", "Hide the channel", ({ id }) => ({ type: "show", channel: id, shown: false })),
  ...keysOfChannel(VOLUME),
  ofChannel("f", "Next transfer function", ({ id, transferFunction, transferFunctions }) => {
    const name = neighbour(transferFunctions, transferFunction, 1);
    return name === null
      ? no(REFUSED.transferless)
      : { type: "choose-transfer-function", channel: id, name };
  }),
  key("k", "Next colour that no other channel has", (context) =>
    withChannel(context, ({ id, color }) => {
      const others = context.state.channels.filter((each) => each.id !== id);
      const hexes = others.map((each) => toHex(each.color));
      return setTo(COLOR, fromHex(nextFreeColour(toHex(color), hexes)), id);
    }),
  ),
  ...CHANNEL.filter((row) => row !== VOLUME).flatMap(keysOfChannel),
  ofChannel("w", "Window: lower end down", shift(-WINDOW_STEP, 0)),
  ofChannel("W", "Window: lower end up", shift(WINDOW_STEP, 0)),
  ofChannel("e", "Window: upper end down", shift(0, -WINDOW_STEP)),
  ofChannel("E", "Window: upper end up", shift(0, WINDOW_STEP)),
];

export const CHANNEL_KEYS: readonly KeyGroup[] = [
  { name: "Channels", rank: 20, keys: KEYS },
  { name: "Value and gradient", rank: 30, keys: SHAPE_KEYS },
];
