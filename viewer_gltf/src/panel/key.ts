/** A key: its names, its label and its request. Pure. */
import type { Box } from "../math/box";
import { optionsOf, type Parameter, setTo, type Value } from "../state/parameters/kinds";
import { REFUSED } from "../state/refusals";
import type { ChannelState, ViewerState } from "../state/viewer_state";
import type { PanelView, Refusal, Request } from "./controls";

export type KeyContext = Readonly<{
  state: ViewerState;
  view: PanelView;
  /** Bounds of the specimen or the isolated tile, um, world. */
  shown: Box;
  focusTile: string | null;
}>;

export type Key = Readonly<{
  /** Names as `keyName` returns them; all have the same effect. */
  keys: readonly string[];
  label: string;
  /** @param name name of the pressed key */
  to: (context: KeyContext, name: string) => Request | Refusal;
}>;
export type KeyGroup = Readonly<{
  name: string;
  /** Place in the list of keys; groups with the same name are joined. */
  rank: number;
  keys: readonly Key[];
  /** Whether the keys have no effect for a specimen without volumes; absent: they always have an effect. */
  needsVolumes?: boolean;
}>;

export function no(refusal: string): Refusal {
  return { refusal };
}

export function isRefusal(answer: Request | Refusal): answer is Refusal {
  return typeof answer !== "string" && "refusal" in answer;
}

const NO_CHANNEL = no(REFUSED.channel);
const NOTHING = no(REFUSED.key);

/** Returns the item after (or before) the present one, cyclically. */
export function neighbour<T>(items: readonly T[], present: T | undefined, by: number): T | null {
  if (items.length === 0) return null;
  const at = present === undefined ? -1 : items.indexOf(present);
  if (at === -1) return by > 0 ? items[0] : items[items.length - 1];
  return items[(at + by + items.length) % items.length];
}

/** Returns the channel that the keys change: that of the open card, or the first shown one. */
function chosenChannel({ state, view }: KeyContext): ChannelState | undefined {
  const shown = state.channels.filter((channel) => channel.shown);
  return shown.find(({ id }) => id === view.picked) ?? shown[0];
}

/** Applies a function to the chosen channel; returns a refusal if no channel is shown. */
export function withChannel(
  context: KeyContext,
  to: (channel: ChannelState) => Request | Refusal,
): Request | Refusal {
  const channel = chosenChannel(context);
  return channel === undefined ? NO_CHANNEL : to(channel);
}

export function key(keys: string | readonly string[], label: string, to: Request | Key["to"]): Key {
  return {
    keys: typeof keys === "string" ? [keys] : keys,
    label,
    to: typeof to === "function" ? to : () => to,
  };
}

/** Returns a key that changes the chosen channel. */
export function ofChannel(
  name: string,
  label: string,
  to: (channel: ChannelState) => Request | Refusal,
): Key {
  return key(name, label, (context) => withChannel(context, to));
}

/** Returns why a parameter cannot be set now; null: it can. */
export function refusalOf<On>(row: Parameter<On>, on: On): Refusal | null {
  const reason = row.refusal?.(on) ?? "";
  return reason === "" ? null : no(reason);
}

/**
 * Returns the keys of a parameter; `find` returns the object that it belongs to, or null if no
 * channel is shown.
 */
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

/** Returns the keys of a parameter that does not belong to a channel. */
export function keysOf(row: Parameter<ViewerState>): readonly Key[] {
  return keysFor(row, ({ state }) => ({ on: state }));
}

/** Returns the keys of a parameter of the chosen channel. */
export function keysOfChannel(row: Parameter<ChannelState>): readonly Key[] {
  return keysFor(row, (context) => {
    const channel = chosenChannel(context);
    return channel === undefined ? null : { on: channel, channel: channel.id };
  });
}
