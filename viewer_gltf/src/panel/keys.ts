/** Every key, what it asks for, and the words of the list that `?` opens. Pure but for the listener. */

import { MAX_SHAPES, type Shape } from "../bundle/transfer_2d";
import type { Box } from "../math/box";
import { fromHex, toHex } from "../math/color";
import { DIALS, shareOf, valueAtShare } from "../state/path_trace_parameters";
import { LIMITS } from "../state/reduce";
import { removeShape, replaceShape } from "../state/transfer_shapes";
import { type ChannelState, isTraced, type ViewerState } from "../state/viewer_state";
import { gripsOf, meantGrip, moveGrip } from "./clip_by_key";
import type { PanelView, Wish } from "./controls";
import { editedShapes, meantShape, SHAPE_NUMBERS, withNewShape } from "./edit_shapes";
import { middleBox, middlePlane, modesOf } from "./layout";
import { nextColour } from "./palettes";
import { pagesOf } from "./sections/channels";
import { LENSES } from "./sections/stereo";
import { chosenTile } from "./sections/tiles";
import { refusalOf, setShapes } from "./sections/transfer_function_2d";

export type KeyContext = Readonly<{
  state: ViewerState;
  view: PanelView;
  /** The specimen, or the isolated tile; um, world. */
  shown: Box;
  gazed: string | null;
}>;

export type Key = Readonly<{
  /** As `keyName` has them; several mean the same. */
  keys: readonly string[];
  label: string;
  /** null: there is nothing to do now. `name`: which of its keys it was. */
  to: (context: KeyContext, name: string) => Wish | null;
}>;
export type KeyGroup = Readonly<{ name: string; keys: readonly Key[] }>;

const QUALITIES = ["auto", "low", "high"] as const;
const OPACITY_STEP = 0.05;
const WINDOW_STEP = 1 / 64;
const DISC_STEP_DEG = 1;
/** Of a distance, so that near and far feel alike. */
const DISTANCE_FACTOR = 1.1;

/** The item after (or before) the present one, round the end. */
function neighbour<T>(items: readonly T[], present: T | undefined, by: number): T | null {
  if (items.length === 0) return null;
  const at = present === undefined ? -1 : items.indexOf(present);
  if (at === -1) return by > 0 ? items[0] : items[items.length - 1];
  return items[(at + by + items.length) % items.length];
}

/** The channel that the channel keys mean: the open card's, or the first one shown. */
export function meantChannel({ state, view }: KeyContext): ChannelState | undefined {
  const shown = state.channels.filter((channel) => channel.shown);
  return shown.find(({ id }) => id === view.picked) ?? shown[0];
}

function key(keys: string | readonly string[], label: string, to: Wish | Key["to"]): Key {
  return {
    keys: typeof keys === "string" ? [keys] : keys,
    label,
    to: typeof to === "function" ? to : () => to,
  };
}

/** A key of the meant channel. */
function ofChannel(name: string, label: string, to: (channel: ChannelState) => Wish | null): Key {
  return key(name, label, (context) => {
    const channel = meantChannel(context);
    return channel === undefined ? null : to(channel);
  });
}

function pick(by: number): Key["to"] {
  return ({ state, view }) => {
    const shown = state.channels.filter((each) => each.shown).map(({ id }) => id);
    const channel = neighbour(shown, view.picked ?? undefined, by);
    return channel === null ? null : { panel: "pick", channel };
  };
}

function nextTile(by: number): Key["to"] {
  return ({ state }) => {
    const ids = state.tiles.map(({ id }) => id);
    const tile = neighbour(ids, state.isolated ?? state.selected ?? undefined, by);
    if (tile === null) return null;
    return state.isolated === null ? { type: "select", tile } : { type: "isolate", tile };
  };
}

function fade(by: number) {
  return ({ id, opacity }: ChannelState): Wish => ({
    type: "fade",
    channel: id,
    opacity: Math.round(100 * (opacity + by)) / 100,
  });
}

function shift(low: number, high: number) {
  return ({ id, window }: ChannelState): Wish => ({
    type: "window",
    channel: id,
    window: [window[0] + low, window[1] + high],
  });
}

function farther(factor: number): Key["to"] {
  const [least, most] = LIMITS.switchDistance_m;
  return ({ state: { switchDistance_m } }) => ({
    type: "set-switch-distance",
    distance_m: Math.min(most, Math.max(least, Number((switchDistance_m * factor).toPrecision(3)))),
  });
}

const wider =
  (by: number): Key["to"] =>
  ({ state }) => ({ type: "set-disc-radius", radius_deg: state.discRadius_deg + by });

function nextGrip(by: number): Key["to"] {
  return ({ state: { clip }, view }) => {
    const grip = neighbour(gripsOf(clip), view.grip ?? undefined, by);
    return grip === null ? null : { panel: "grip", grip };
  };
}

function push(steps: number): Key["to"] {
  return ({ state: { clip }, view, shown }) => {
    const grip = meantGrip(clip, view.grip);
    return grip === undefined ? null : moveGrip(grip, steps, clip, shown);
  };
}

function nextDial(by: number): Key["to"] {
  return ({ view }) => {
    const ids = DIALS.map(({ id }) => id);
    const dial = neighbour(ids, view.dial ?? undefined, by);
    return dial === null ? null : { panel: "dial", dial };
  };
}

function turn(steps: number): Key["to"] {
  return ({ state: { trace }, view }) => {
    const dial = DIALS.find(({ id }) => id === view.dial) ?? DIALS[0];
    const at = shareOf(dial, dial.of(trace)) + (2 * steps) / dial.steps;
    return dial.to(valueAtShare(dial, Math.min(1, Math.max(0, at))));
  };
}

const DIGITS = ["1", "2", "3", "4", "5", "6", "7", "8", "9"] as const;

const CHANNEL_KEYS: readonly Key[] = [
  key(DIGITS, "Show or hide this channel of the bundle", ({ state }, name) => {
    const channel = state.channels[Number(name) - 1];
    if (channel === undefined) return null;
    return { type: "show", channel: channel.id, shown: !channel.shown };
  }),
  key("/", "Find a channel that is not shown", "find"),
  key("A", "Next page of the channels that are not shown", ({ state, view }) => {
    const pages = pagesOf(state, view.search);
    return pages === 1 ? null : { panel: "page", page: (view.page + 1) % pages };
  }),
  key("c", "Next channel: the keys below mean it", pick(1)),
  key("C", "Previous channel", pick(-1)),
  ofChannel("x", "Hide the channel", ({ id }) => ({ type: "show", channel: id, shown: false })),
  ofChannel("v", "Volume on or off", ({ id, volume }) => ({
    type: "draw-volume",
    channel: id,
    volume: !volume,
  })),
  ofChannel("f", "Next transfer function", ({ id, transferFunction, transferFunctions }) => {
    const name = neighbour(transferFunctions, transferFunction, 1);
    return name === null ? null : { type: "choose-transfer-function", channel: id, name };
  }),
  ofChannel("k", "Next colour of the palettes", ({ id, color }) => ({
    type: "recolor",
    channel: id,
    color: fromHex(nextColour(toHex(color))),
  })),
  ofChannel("o", "Less opacity", fade(-OPACITY_STEP)),
  ofChannel("O", "More opacity", fade(OPACITY_STEP)),
  ofChannel("w", "Window: lower end down", shift(-WINDOW_STEP, 0)),
  ofChannel("W", "Window: lower end up", shift(WINDOW_STEP, 0)),
  ofChannel("e", "Window: upper end down", shift(0, -WINDOW_STEP)),
  ofChannel("E", "Window: upper end up", shift(0, WINDOW_STEP)),
];

/** Of a shape's number: five cells of its table. */
const SHAPE_STEP = 5 / 255;

function addShapeOf(kind: Shape["kind"]) {
  return (channel: ChannelState): Wish | null => {
    if (refusalOf(channel) !== "") return null;
    const shapes = withNewShape(channel, kind);
    return shapes.length > MAX_SHAPES ? null : setShapes(channel, shapes);
  };
}

/** A key of the meant shape of the meant channel; `shape` null: without it. */
function ofShape(
  name: string,
  label: string,
  to: (shape: Shape, view: PanelView) => Shape | null,
): Key {
  return key(name, label, (context) => {
    const channel = meantChannel(context);
    if (channel === undefined || refusalOf(channel) !== "") return null;
    const shapes = editedShapes(channel);
    const index = meantShape(context.view.shape, shapes);
    if (index === null) return null;
    const changed = to(shapes[index], context.view);
    return setShapes(
      channel,
      changed === null ? removeShape(shapes, index) : replaceShape(shapes, index, changed),
    );
  });
}

function changeNumber(steps: number) {
  return (shape: Shape, { shapeNumber }: PanelView): Shape => {
    const [first] = SHAPE_NUMBERS;
    const number = SHAPE_NUMBERS.find(({ id, isOf }) => id === shapeNumber && isOf(shape)) ?? first;
    return number.by(shape, steps * SHAPE_STEP);
  };
}

const SHAPE_KEYS: readonly Key[] = [
  ofChannel("H", "Plane of value and gradient: open or close", ({ id }) => ({
    panel: "plane",
    channel: id,
  })),
  ofChannel("Q", "Add a rectangle", addShapeOf("rectangle")),
  ofChannel("Y", "Add a triangle", addShapeOf("triangle")),
  key("J", "Next shape: the keys below mean it", (context) => {
    const channel = meantChannel(context);
    const shapes = channel === undefined ? [] : editedShapes(channel);
    const present = meantShape(context.view.shape, shapes);
    if (present === null) return null;
    const { length: count } = shapes;
    return { panel: "shape", shape: { index: (present + 1) % count, count }, grasp: null };
  }),
  key(";", "Next number of the shape", ({ view }) => {
    const ids = SHAPE_NUMBERS.map(({ id }) => id);
    const id = neighbour(ids, view.shapeNumber ?? ids[0], 1);
    return id === null ? null : { panel: "shape-number", id };
  }),
  ofShape("<", "Less of it", changeNumber(-1)),
  ofShape(">", "More of it", changeNumber(1)),
  ofShape("*", "Next colour of the shape", (shape) => ({
    ...shape,
    color: fromHex(nextColour(toHex(shape.color))),
  })),
  ofShape("Shift+Delete", "Remove the shape", () => null),
];

const VOLUME_KEYS: readonly Key[] = [
  key("m", "Next mode: where volumes show", ({ state }) => {
    const mode = neighbour(modesOf(state), state.mode, 1);
    return mode === null ? null : { type: "choose-mode", mode };
  }),
  key("s", "Smaller switch distance", farther(1 / DISTANCE_FACTOR)),
  key("S", "Larger switch distance", farther(DISTANCE_FACTOR)),
  key("d", "Smaller disc", wider(-DISC_STEP_DEG)),
  key("D", "Larger disc", wider(DISC_STEP_DEG)),
  key("q", "Next quality", ({ state }) => {
    const level = neighbour(QUALITIES, state.quality, 1);
    return level === null ? null : { type: "choose-quality", level };
  }),
];

const LIGHT_KEYS: readonly Key[] = [
  key("G", "Paths of light on or off", ({ state }) => ({
    type: "choose-mode",
    mode: isTraced(state) ? "all" : "traced",
  })),
  key("F", "Next number of the light: the two keys below mean it", nextDial(1)),
  key("X", "The number before", nextDial(-1)),
  key("[", "Less of it", turn(-1)),
  key("]", "More of it", turn(1)),
  key("M", "Scattered once or many times", ({ state: { trace } }) => ({
    type: "trace",
    change: { isMultiple: !trace.isMultiple },
  })),
  key("I", "Next room", ({ state: { trace } }) => ({
    type: "trace",
    change: { environment: trace.environment === "studio" ? "sky" : "studio" },
  })),
  key("U", "Light of a .hdr or .exr file", "own-light"),
  key(["!", "@", "#"], "Lamp 1, 2 or 3 on or off", ({ state: { trace } }, name) => {
    const lamp = ["!", "@", "#"].indexOf(name);
    return { type: "move-lamp", lamp, change: { isOn: !trace.lamps[lamp].isOn } };
  }),
  key("$", "Show or hide the lamps, to be dragged", ({ state }) =>
    isTraced(state) ? { type: "show-lamps", areShown: !state.areLampsShown } : null,
  ),
  key("Z", "Before or after what comes after the light", ({ state: { trace } }) => ({
    type: "trace",
    change: { isPostOn: !trace.isPostOn },
  })),
];

const TILE_KEYS: readonly Key[] = [
  key("t", "Next tile", nextTile(1)),
  key("T", "Previous tile", nextTile(-1)),
  key("i", "Show only the tile that is chosen or looked at; again: all", (context) => {
    const { state, gazed } = context;
    if (state.isolated !== null) return { type: "isolate", tile: null };
    const tile = state.selected ?? gazed;
    return tile === null ? null : { type: "isolate", tile };
  }),
  key("g", "Choose the tile that is looked at", ({ state, gazed }) =>
    gazed === null ? null : chosenTile(state, gazed),
  ),
  key(["Escape", "Backspace"], "Back: all tiles, then none chosen", "back"),
];

const VIEW_KEYS: readonly Key[] = [
  key("ArrowLeft", "Turn left", "turn-left"),
  key("ArrowRight", "Turn right", "turn-right"),
  key("ArrowUp", "Turn up", "turn-up"),
  key("ArrowDown", "Turn down", "turn-down"),
  key("Shift+ArrowLeft", "Move left", "pan-left"),
  key("Shift+ArrowRight", "Move right", "pan-right"),
  key("Shift+ArrowUp", "Move up", "pan-up"),
  key("Shift+ArrowDown", "Move down", "pan-down"),
  key(["+", "="], "Zoom in", "zoom-in"),
  key("-", "Zoom out", "zoom-out"),
  key("z", "From the front (along z)", "front"),
  key("a", "From the side (along x)", "side"),
  key("y", "From the top (along y)", "top"),
  key("r", "Reset the view", "reset"),
  key("V", "Enter stereo (VR), or leave it", "stereo"),
  key("L", "Next phone viewer", ({ view }) => {
    const lenses = neighbour(LENSES, view.lenses, 1);
    return lenses === null ? null : { panel: "lenses", lenses };
  }),
  key("P", "Split screen for a phone viewer", "split"),
  key("K", "Scan the phone viewer's code", "scan"),
  key("j", "Choosing by gaze on or off", ({ state }) => ({
    type: "set-dwell",
    isOn: !state.isDwellOn,
  })),
];

const TOOL_KEYS: readonly Key[] = [
  key("p", "A tap selects or measures", ({ state }) => ({
    type: "choose-tool",
    tool: state.tool === "select" ? "measure" : "select",
  })),
  key("Enter", "Tap in the middle of the view", "press"),
  key("u", "Clear what was measured", ({ state }) =>
    state.measured.length === 0 ? null : { type: "measure", points: [] },
  ),
  key("b", "Cut by a box: on or off", ({ state: { clip }, shown }) => ({
    type: "set-clip",
    clip: { ...clip, box: clip.box === null ? middleBox(shown) : null },
  })),
  key("n", "Cut by a plane: on or off", ({ state: { clip }, shown }) => ({
    type: "set-clip",
    clip: { ...clip, plane: clip.plane === null ? middlePlane(shown) : null },
  })),
  key("N", "Next part of the cuts: a face, the plane, its turn", nextGrip(1)),
  key("B", "The part before", nextGrip(-1)),
  key(",", "Move or turn that part back", push(-1)),
  key(".", "Move or turn that part on", push(1)),
  key("l", "Copy a link to this view", "share"),
  key("Delete", "Dismiss the newest notice", ({ state }) => {
    const text = state.notices.at(-1);
    return text === undefined ? null : { type: "dismiss", text };
  }),
  key("R", "Try again what the network failed to bring", ({ state }) =>
    state.mendable.length === 0 ? null : "retry",
  ),
  key("h", "Hide or show the panel", { panel: "hide" }),
  key("?", "This list", { panel: "help" }),
];

export const KEYS: readonly KeyGroup[] = [
  { name: "View", keys: VIEW_KEYS },
  { name: "Channels", keys: CHANNEL_KEYS },
  { name: "Value and gradient", keys: SHAPE_KEYS },
  { name: "Volumes", keys: VOLUME_KEYS },
  { name: "Light", keys: LIGHT_KEYS },
  { name: "Tiles", keys: TILE_KEYS },
  { name: "Tools", keys: TOOL_KEYS },
];

const BY_KEY: ReadonlyMap<string, Key> = new Map(
  KEYS.flatMap(({ keys }) =>
    keys.flatMap((each) => each.keys.map((name) => [name, each] as const)),
  ),
);

export function wishOf(name: string, context: KeyContext): Wish | null {
  return BY_KEY.get(name)?.to(context, name) ?? null;
}

/**
 * The name of a key that was pressed: as `KeyboardEvent.key` has it, with Shift where that leaves no
 * mark on it. Where a keyboard writes other letters than Latin ones, their place counts.
 */
export function keyName({
  key: written,
  code,
  shiftKey,
}: Pick<KeyboardEvent, "key" | "code" | "shiftKey">): string {
  if (written.length > 1) return shiftKey ? `Shift+${written}` : written;
  const [, letter] = /^Key([A-Z])$/.exec(code) ?? [];
  if (letter === undefined || written <= "~") return written;
  return shiftKey ? letter : letter.toLowerCase();
}

/**
 * What has the keyboard. A text field takes every key; a control those that it is worked by: a
 * button is pressed, a list (or a slider, or radio buttons) is gone through as well.
 */
export type Focus = "field" | "list" | "button" | "page";

const PRESS = ["Enter", " "];
const GO_THROUGH = [
  ...["ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown"],
  ...["Home", "End", "PageUp", "PageDown"],
];

export function firesOn(name: string, focus: Focus): boolean {
  if (focus === "page") return true;
  if (focus === "field") return false;
  const plain = name.replace(/^Shift\+/, ""); // which changes nothing to a control
  return !PRESS.includes(plain) && !(focus === "list" && GO_THROUGH.includes(plain));
}

const TEXT_INPUTS = ["text", "search", "url", "number", "email", "password", "tel"];

/** Groups of buttons with one stop of the Tab key take their arrows themselves: see roving_tabindex.ts. */
export function focusOf(target: EventTarget | null): Focus {
  if (!(target instanceof HTMLElement)) return "page";
  if (target.isContentEditable || target instanceof HTMLTextAreaElement) return "field";
  if (target instanceof HTMLSelectElement) return "list";
  if (target instanceof HTMLInputElement) {
    if (TEXT_INPUTS.includes(target.type)) return "field";
    return target.type === "range" || target.type === "radio" ? "list" : "button";
  }
  return target instanceof HTMLButtonElement ? "button" : "page";
}

/** @param onKey returns whether the key did something: then the browser does nothing with it */
export function listenForKeys(onKey: (name: string) => boolean, signal: AbortSignal): void {
  addEventListener(
    "keydown",
    (event) => {
      if (event.defaultPrevented || event.isComposing) return;
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      if (document.querySelector("dialog[open]") !== null) return;
      const { target } = event;
      const name = keyName(event);
      const focus = focusOf(target);
      if (firesOn(name, focus)) {
        if (onKey(name)) event.preventDefault();
      } else if (focus === "field" && name === "Escape" && target instanceof HTMLElement) {
        target.blur(); // what was typed stays
        event.preventDefault();
      }
    },
    { signal },
  );
}
