/**
 * The section of the channels on the panel. A few channels have a card each, in the order of the
 * bundle. If there are many, the shown channels have cards, and the others are a list with a search and
 * pages, since there may be seventy. No row moves when a channel is shown or hidden. Otherwise the
 * next row would slide under the pointer or the gaze. Pure.
 */

import { toHex } from "../math/color";
import { colourOf, controlOf, paletteOf } from "../panel/control_templates";
import type {
  Colour,
  Control,
  Group,
  Histogram,
  PanelView,
  PartSection,
  Section,
} from "../panel/controls";
import { freeColours } from "../panel/palettes";
import { transferTitle } from "../panel/transfer_titles";
import { intensityText, type Ranges, windowTexts } from "../panel/window_texts";
import { CHANNEL, COLOR, OPACITY, VOLUME } from "../state/parameters/channel";
import { REFUSED } from "../state/refusals";
import type { ChannelState, ViewerState } from "../state/viewer_state";
import { transferFunction2dItems } from "./transfer_function_2d";

/** Largest number of channels that all have a card. */
const FEW = 9;
/** Channels on a page of the list. A shorter list has no search. */
export const PAGE = 6;
/** Steps of a window's slider, for volumes of 8 bits. */
const WINDOW_STEPS = 255;

/** Facts about the channels that are not in the state. */
export type ChannelFacts = Readonly<{
  ranges: Ranges;
  /** Joint histogram of the channel whose histogram is open; null: not loaded yet. */
  histogram?: Histogram | null;
  /** Some colours of the objects of each label map. */
  objectColors?: ReadonlyMap<string, readonly string[]>;
}>;

function tagsOf({ hasSurface, surfaceReason }: ChannelState): string[] {
  if (surfaceReason !== "") return [surfaceReason.split(":", 1)[0]];
  return hasSurface ? [] : ["no surface"];
}

function shownToggle({ id, name, shown }: ChannelState): Control {
  return {
    kind: "toggle",
    id: `${id}/shown`,
    label: "Shown",
    name: `Show ${name}`,
    value: shown,
    to: (value) => ({ type: "show", channel: id, shown: value }),
  };
}

/** Returns the colour control of a channel, with the colours that no other channel has. */
function ownColour(channel: ChannelState, channels: readonly ChannelState[]): Colour {
  const others = channels.filter(({ id }) => id !== channel.id).map(({ color }) => toHex(color));
  return { ...colourOf(COLOR, channel, channel.id), free: freeColours(others) };
}

function cardOf(
  channel: ChannelState,
  { channels }: ViewerState,
  { ranges, histogram = null, objectColors = new Map() }: ChannelFacts,
  view: PanelView,
): Group {
  const { id, name } = channel;
  const isOpen = view.picked === id;
  const toWindow = (window: readonly [number, number]) =>
    ({ type: "window", channel: id, window }) as const;
  const range = ranges.get(id);
  const head = {
    kind: "group",
    id,
    label: name,
    tags: tagsOf(channel),
    about: channel.surfaceReason,
    isDimmed: !channel.shown,
    isOpen,
    opener: { panel: "pick", channel: isOpen ? null : id },
  } as const;
  if (channel.hasObjects) {
    const shows = objectColors.get(id) ?? [];
    const controls = [colourOf(COLOR, channel, id, shows), shownToggle(channel)];
    const opacity = controlOf(OPACITY, channel, id);
    return { ...head, controls, more: [opacity, paletteOf(COLOR, channel, `${id}/palette`, id)] };
  }
  return {
    ...head,
    controls: [ownColour(channel, channels), shownToggle(channel)],
    more: [
      controlOf(VOLUME, channel, id),
      {
        kind: "choice",
        id: `${id}/transfer-function`,
        label: "Transfer function",
        name: `Transfer function of ${name}`,
        about: "Decides which values of the volume are visible, and how dense they look.",
        value: channel.transferFunction,
        options: channel.transferFunctions.map((each) => ({
          value: each,
          label: transferTitle(channel, each),
        })),
        isInline: false,
        refusal: channel.volume ? "" : REFUSED.transfer,
        to: (each) => ({ type: "choose-transfer-function", channel: id, name: each }),
      },
      ...CHANNEL.filter((row) => row !== COLOR && row !== VOLUME).map((row) =>
        controlOf(row, channel, id),
      ),
      {
        kind: "window",
        id: `${id}/window`,
        label: "Window",
        name: `Window of ${name}`,
        about:
          "The values that are shown darkest and brightest. A narrower window has more contrast.",
        value: channel.window,
        steps: WINDOW_STEPS,
        texts: windowTexts(channel.window, range),
        to: toWindow,
      },
      paletteOf(COLOR, channel, `${id}/palette`, id),
      ...transferFunction2dItems(channel, view, histogram, (share) => intensityText(share, range)),
    ],
  };
}

/** Returns the channels with a card above the list. */
function withCards(
  { channels }: ViewerState,
  { channelsWithCard: ids }: PanelView,
): readonly ChannelState[] {
  if (channels.length <= FEW) return channels;
  return channels.filter(({ id, shown }) => ids?.includes(id) ?? shown);
}

/** Returns the channels of the list whose name or id contains the search text. */
function foundChannels(
  state: ViewerState,
  view: PanelView,
  search = view.search,
): readonly ChannelState[] {
  const text = search.trim().toLowerCase();
  const cards = withCards(state, view);
  return state.channels.filter(
    (channel) =>
      !cards.includes(channel) &&
      (channel.name.toLowerCase().includes(text) || channel.id.toLowerCase().includes(text)),
  );
}

/** Returns the number of pages of the found channels. */
export function pagesOf(state: ViewerState, view: PanelView): number {
  return Math.max(1, Math.ceil(foundChannels(state, view).length / PAGE));
}

/** Returns beginnings of the channels' names, for example `CD`: the letters up to a digit, at most three. */
function beginningsOf(channels: readonly ChannelState[]): readonly string[] {
  const found = channels.map(({ name }) => /^\p{L}{1,3}/u.exec(name)?.[0] ?? name.slice(0, 1));
  return [...new Set(found)].sort((a, b) => a.localeCompare(b, "en"));
}

function addingOf(
  state: ViewerState,
  facts: ChannelFacts,
  view: PanelView,
): readonly (Control | Group)[] {
  const all = foundChannels(state, view, "");
  if (all.length === 0) return [];
  const isLong = all.length > PAGE;
  const found = isLong ? foundChannels(state, view) : all;
  const pages = Math.max(1, Math.ceil(found.length / PAGE));
  const page = Math.min(view.page, pages - 1);
  const items: (Control | Group)[] = [];
  if (isLong) {
    items.push({
      kind: "search",
      id: "find-channel",
      label: `Add one of ${all.length} more channels`,
      value: view.search,
      hints: beginningsOf(all),
      to: (text) => ({ panel: "find", text }),
    });
  }
  for (const channel of found.slice(page * PAGE, (page + 1) * PAGE)) {
    items.push(rowOf(cardOf(channel, state, facts, view)));
  }
  if (isLong && found.length === 0) {
    const value = `No channel in the list matches "${view.search.trim()}".`;
    items.push({ kind: "text", id: "no-channel", label: "Channels", value });
  }
  if (pages > 1) {
    items.push({
      kind: "button",
      id: "next-channels",
      label: `Next ${PAGE} (page ${page + 1} of ${pages})`,
      isStep: true,
      to: () => ({ panel: "page", page: (page + 1) % pages }),
    });
  }
  return items;
}

/**
 * Returns a card as a row of the list: swatch and switch, and the other controls once the channel
 * is shown and opened.
 */
function rowOf(card: Group): Group {
  const canOpen = !card.isDimmed || card.isOpen;
  return { ...card, isCompact: true, more: canOpen ? card.more : [] };
}

function channelItems(state: ViewerState, facts: ChannelFacts, view: PanelView): Section["items"] {
  const cards = withCards(state, view).map((channel) => cardOf(channel, state, facts, view));
  return [...cards, ...addingOf(state, facts, view)];
}

export function channelSections(
  state: ViewerState,
  facts: ChannelFacts,
  view: PanelView,
): readonly PartSection[] {
  return [{ rank: 10, id: "channels", label: "Channels", items: channelItems(state, facts, view) }];
}
