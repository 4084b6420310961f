/** A key: its names, the words for it, and its request. Pure. */
import type { Box } from "../math/box";
import { optionsOf, type Parameter, setTo, type Value } from "../state/parameters/kinds";
import { REFUSED } from "../state/refusals";
import type { ChannelState, ViewerState } from "../state/viewer_state";
import type { PanelView, Refusal, Wish } from "./controls";

export type KeyContext = Readonly<{
  state: ViewerState;
  view: PanelView;
  /** The specimen, or the isolated tile; um, world. */
  shown: Box;
  focusTile: string | null;
}>;

export type Key = Readonly<{
  /** As `keyName` has them; several mean the same. */
  keys: readonly string[];
  label: string;
  /** @param name which of its keys it was */
  to: (context: KeyContext, name: string) => Wish | Refusal;
}>;
export type KeyGroup = Readonly<{
  name: string;
  /** Place in the list of keys; groups of one name are joined. */
  rank: number;
  keys: readonly Key[];
  /** Whether its keys do nothing for a specimen without volumes; absent: they always do something. */
  needsVolumes?: boolean;
}>;

export function no(refusal: string): Refusal {
  return { refusal };
}

export function isRefusal(answer: Wish | Refusal): answer is Refusal {
  return typeof answer !== "string" && "refusal" in answer;
}

const NO_CHANNEL = no(REFUSED.channel);
const NOTHING = no(REFUSED.key);

/** The item after (or before) the present one, round the end. */
export function neighbour<T>(items: readonly T[], present: T | undefined, by: number): T | null {
  if (items.length === 0) return null;
  const at = present === undefined ? -1 : items.indexOf(present);
  if (at === -1) return by > 0 ? items[0] : items[items.length - 1];
  return items[(at + by + items.length) % items.length];
}

/** The channel that the channel keys mean: the open card's, or the first one shown. */
function meantChannel({ state, view }: KeyContext): ChannelState | undefined {
  const shown = state.channels.filter((channel) => channel.shown);
  return shown.find(({ id }) => id === view.picked) ?? shown[0];
}

/** The meant channel, or why there is none. */
export function withChannel(
  context: KeyContext,
  to: (channel: ChannelState) => Wish | Refusal,
): Wish | Refusal {
  const channel = meantChannel(context);
  return channel === undefined ? NO_CHANNEL : to(channel);
}

export function key(keys: string | readonly string[], label: string, to: Wish | Key["to"]): Key {
  return {
    keys: typeof keys === "string" ? [keys] : keys,
    label,
    to: typeof to === "function" ? to : () => to,
  };
}

/** A key of the meant channel. */
export function ofChannel(
  name: string,
  label: string,
  to: (channel: ChannelState) => Wish | Refusal,
): Key {
  return key(name, label, (context) => withChannel(context, to));
}

/** Why a parameter can't be set now; null: it can. */
export function refusalOf<On>(row: Parameter<On>, on: On): Refusal | null {
  const reason = row.refusal?.(on) ?? "";
  return reason === "" ? null : no(reason);
}

/** What keys do to a parameter; `find` gives what it is of, null: there is no channel now. */
function keysFor<On>(
  row: Parameter<On>,
  find: (context: KeyContext) => Readonly<{ on: On; channel?: string }> | null,
): readonly Key[] {
  const toValue = (next: (on: On) => Value | null): Key["to"] => {
    return (context) => {
      const found = find(context);
      if (found === null) return NO_CHANNEL;
      const refused = refusalOf(row, found.on);
      if (refused !== null) return refused;
      const value = next(found.on);
      return value === null ? NOTHING : setTo<Value>(row, value, found.channel);
    };
  };
  switch (row.kind) {
    case "number": {
      if (row.keys === undefined) return [];
      const { less, more, next } = row.keys;
      const by = (direction: -1 | 1) => (on: On) => next(row.get(on), direction);
      return [key(...less, toValue(by(-1))), key(...more, toValue(by(1)))];
    }
    case "switch":
      return row.key === undefined
        ? []
        : [
            key(
              ...row.key,
              toValue((on) => !row.get(on)),
            ),
          ];
    case "choice": {
      if (row.key === undefined) return [];
      const next = (on: On) => {
        const options = optionsOf(row, on).filter((value) => value !== row.ownValue);
        return neighbour(options, row.get(on), 1);
      };
      return [key(...row.key, toValue(next))];
    }
    case "colour":
      return [];
  }
}

/** The keys of a parameter that is no channel's. */
export function keysOf(row: Parameter<ViewerState>): readonly Key[] {
  return keysFor(row, ({ state }) => ({ on: state }));
}

/** The keys of a parameter of the meant channel. */
export function keysOfChannel(row: Parameter<ChannelState>): readonly Key[] {
  return keysFor(row, (context) => {
    const channel = meantChannel(context);
    return channel === undefined ? null : { on: channel, channel: channel.id };
  });
}
