/**
 * Exchanges messages with the page that holds this page in a frame. It accepts messages only from that page, and only if
 * its origin is the one in the address (`?embed=https://lab.example`). Each message is checked before it has an effect.
 */
import type { Manifest } from "../bundle/generated/bundle";
import type { Asked } from "./view_sharing";

/** Name in each message in both directions, since a page may also receive messages of other senders. */
const NAME = "stereocell";
const COLOUR = /^#[0-9a-f]{6}$/i;

type Check = (value: unknown) => boolean;

const isNumber: Check = (value) => Number.isFinite(value);
const isText: Check = (value) => typeof value === "string";
const isListOf =
  (length: number): Check =>
  (value) =>
    Array.isArray(value) && value.length === length && value.every(isNumber);
const isPoint = isListOf(3);

const OF_CHANNEL: Readonly<Record<string, readonly [Check, string]>> = {
  visible: [(value) => typeof value === "boolean", "true or false"],
  color: [(value) => isText(value) && COLOUR.test(value as string), "#rrggbb"],
  opacity: [(value) => isNumber(value) && Math.abs((value as number) - 0.5) <= 0.5, "0 to 1"],
  window: [isListOf(2), "two numbers"],
};
const OF_VIEW = {
  eye_um: [isPoint, "three numbers"],
  target_um: [isPoint, "three numbers"],
} as const;
const OF_PICKED = {
  point_um: [isPoint, "three numbers"],
  tile: [isText, "a text"],
  channel: [(value: unknown) => value === null || isText(value), "a text or null"],
  object: [(value: unknown) => value === null || isText(value), "a text or null"],
} as const;

function isRecord(value: unknown): value is Readonly<Record<string, unknown>> {
  return typeof value === "object" && value !== null && !Array.isArray(value);
}

/** Returns the first fault of an object's fields as a text; null if there is none. */
function faultOfFields(
  name: string,
  value: unknown,
  fields: Readonly<Record<string, readonly [Check, string]>>,
): string | null {
  if (!isRecord(value)) return `${name} is ${JSON.stringify(value)}, expected an object`;
  for (const [key, field] of Object.entries(value)) {
    const known = fields[key];
    const expected = known?.[1] ?? `one of ${Object.keys(fields).join(", ")}`;
    if (!known?.[0](field)) {
      const found = known === undefined ? "unknown" : JSON.stringify(field);
      return `${name}.${key} is ${found}, expected ${expected}`;
    }
  }
  return null;
}

/** Returns the reason why a state can't be shown; null if it can. @param channels the IDs of the bundle's channels */
export function faultOfState(state: unknown, channels: readonly string[]): string | null {
  if (!isRecord(state)) return `state is ${JSON.stringify(state)}, expected an object`;
  for (const [key, value] of Object.entries(state)) {
    const fault = faultOfPart(key, value, channels);
    if (fault !== null) return fault;
  }
  return null;
}

function faultOfPart(key: string, value: unknown, channels: readonly string[]): string | null {
  switch (key) {
    case "link":
      return isText(value) ? null : `link is ${JSON.stringify(value)}, expected a text`;
    case "view":
      return faultOfFields("view", value, OF_VIEW);
    case "picked":
      return value === null ? null : faultOfFields("picked", value, OF_PICKED);
    case "channels": {
      if (!isRecord(value)) return `channels is ${JSON.stringify(value)}, expected an object`;
      const faults = Object.entries(value).map(([id, look]) =>
        channels.includes(id)
          ? faultOfFields(`channels.${id}`, look, OF_CHANNEL)
          : `channels.${id} is unknown, expected one of ${channels.join(", ")}`,
      );
      return faults.find((fault) => fault !== null) ?? null;
    }
    default:
      return `${key} is unknown, expected link, channels, view or picked`;
  }
}

/** Returns the origin whose page may control this one; null if the address names none. */
export function embedOrigin(search: string): string | null {
  const asked = new URLSearchParams(search).get("embed");
  if (asked === null || !URL.canParse(asked)) return null;
  const { origin, protocol } = new URL(asked);
  return protocol === "https:" || protocol === "http:" ? origin : null;
}

/** Returns a port to the page of the origin in the address; null if the address names none. */
export function portToHolder(search: string, { channels }: Manifest): FramePort | null {
  const origin = embedOrigin(search);
  const ids = channels.map(({ id }) => id);
  return origin === null ? null : new FramePort(origin, ids);
}

type Message = Readonly<{ type: string }>;

/** A port to the surrounding page, with the methods of a MessagePort that ViewSharing uses. */
export class FramePort {
  constructor(
    private readonly origin: string,
    private readonly channels: readonly string[],
    private readonly holder: Pick<Window, "postMessage"> = parent,
  ) {}

  addEventListener(type: "message", listener: (event: MessageEvent) => void): void {
    addEventListener(type, ({ origin, source, data }) => {
      if (origin !== this.origin || source !== this.holder || data?.target !== NAME) return;
      const fault = faultOfState(data.state, this.channels);
      if (fault !== null) {
        this.postMessage({ type: "refused", reason: fault } as Message);
        return;
      }
      const state = data.state as Asked;
      listener(new MessageEvent("message", { data: { type: "state", state } }));
    });
  }

  /** Sends a message. Pictures are not sent, since only a saved notebook needs them. */
  postMessage(message: Message): void {
    if (message.type === "picture") return;
    this.holder.postMessage({ source: NAME, ...message }, this.origin);
  }
}
