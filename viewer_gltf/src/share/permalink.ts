/**
 * Converts a view to the part of an address after `#`, and back. Pure.
 *
 *   #v=1&c=DAPI,CD8&l=DAPI:c3050ff:o0.5,CD8:n&mode=tile&eye=0,0,1.8,0,0,0
 *
 * A link contains only differences from the state in which the bundle opens:
 *
 * - `v`: version of the link
 * - `c`: the channels shown
 * - `l`: the channels with a changed appearance, and the letters below for each
 * - `mode`: where volumes are drawn
 * - `switch`: volume distance, m of the scene
 * - `disc`: radius of the focus disc, degrees
 * - `tile`: the selected tile
 * - `only`: the isolated tile
 * - `box`: low and high corner of the clip box, um
 * - `cut`: normal and offset (um) of the clip plane; `none`: the opening cut is removed
 * - `points`: the points of the newest measurement, um
 * - `measures`: the finished measurements (see measurements_link.ts)
 * - `views`: the saved views, each in the form of `eye`
 * - `objects`: selection and colours of label maps (see objects/linked.ts)
 * - `light`: settings of path tracing (see path_trace_link.ts)
 * - `eye`: position and target of the camera, m of the scene
 * - `pose`: place, rotation and scale of a specimen that was moved
 *
 * Further names (such as `tool`, `dwell` and `quality`) are the `link` of a parameter in state/parameters.
 *
 * The letters of a channel in `l`:
 *
 * - `c`: colour, sRGB
 * - `o`: opacity
 * - `w`: window, `low_high`
 * - `s`: shapes of a transfer function, `name_shapes` (see shapes_link.ts)
 * - `t`: name of the transfer function
 * - `n`: no volume
 *
 * An address may come from anyone. Any text leads only to actions that a user could take, and an unreadable part is
 * reported and left out.
 */

import type { Box } from "../math/box";
import { type Clip, withinSpecimen } from "../math/clip";
import type { Vec3 } from "../math/vec3";
import { AXES } from "../math/vec3";
import type { Action } from "../state/actions";
import type { CameraView } from "../state/camera_view";
import type { ObjectView } from "../state/objects";
import { CHANNEL, START_CHANNEL } from "../state/parameters/channel";
import type { Parameter } from "../state/parameters/kinds";
import { LIGHT } from "../state/parameters/light";
import { allParameters } from "../state/parameters/table";
import { VOLUMES } from "../state/parameters/volumes";
import { OWN } from "../state/transfer_functions_2d";
import { type ChannelState, MAX_CHANNELS, type ViewerState } from "../state/viewer_state";
import { readCamera, writeCamera } from "./camera_link";
import { linkedMeasurements, readMeasurements } from "./measurements_link";
import { readNumbers, written } from "./numbers";
import { readWord, type SwitchWords, writeWords } from "./parameter_words";
import { readLight, writeLight } from "./path_trace_link";
import { readShapes, writeShapes } from "./shapes_link";

const VERSION = "1";
const UNCUT = "none"; // in place of a plane: the user removed the cut with which the specimen opens
/** Longest link, characters; enough for seventy channels that all have a changed appearance. */
const LONGEST = 8000;
const WORDS: SwitchWords = ["off", "on"];
/** Words for a channel's switches: the letter alone means off. */
const CHANNEL_WORDS: SwitchWords = ["", "on"];
const NAMED_APART: ReadonlySet<Parameter<ViewerState>> = new Set([...VOLUMES, ...LIGHT]);
/** All parameters except those of volumes and those of the light, which are written separately. */
const otherParameters = () => allParameters().filter((row) => !NAMED_APART.has(row));

export type Shared = Readonly<{ actions: readonly Action[]; camera: CameraView | null }>;

/** Returns a link's text for a channel's objects; "" if the link needs none. */
type WriteObjects = (channel: string, view: ObjectView) => string;

/**
 * Writes the link to a view. If it would be too long, shapes of transfer functions that do not show are left out.
 *
 * @param start the state in which the bundle opens
 * @param camera null for the camera with which the bundle opens
 */
export function writeLink(
  state: ViewerState,
  start: ViewerState,
  camera: CameraView | null,
  objectsOf: WriteObjects = (_, { linked }) => linked,
): string {
  const links = [isAnything, isChosen, isShown].map((has) =>
    linkOf(state, start, camera, objectsOf, has),
  );
  return links.find(({ length }) => length <= LONGEST) ?? links[links.length - 1];
}

/** Returns whether the shapes of a function are part of a link, which may not have room for all shapes. */
type HasShapes = (channel: ChannelState, name: string) => boolean;
const isAnything: HasShapes = () => true;
const isChosen: HasShapes = ({ transferFunction }, name) => name === transferFunction;
const isShown: HasShapes = (channel, name) => channel.shown && isChosen(channel, name);

function linkOf(
  state: ViewerState,
  start: ViewerState,
  camera: CameraView | null,
  objectsOf: WriteObjects,
  has: HasShapes,
): string {
  const parts: Record<string, string> = { v: VERSION };
  const shownOf = ({ channels }: ViewerState) =>
    channels
      .filter(({ shown }) => shown)
      .map(({ id }) => encodeURIComponent(id))
      .join(",");
  if (shownOf(state) !== shownOf(start)) parts.c = shownOf(state);
  const appearances = state.channels.flatMap((channel, i) =>
    writeChannel(channel, start.channels[i], has),
  );
  if (appearances.length > 0) parts.l = appearances.join(",");
  Object.assign(parts, Object.fromEntries(writeWords(VOLUMES, state, start, WORDS)));
  const objects = Object.entries(state.objects).flatMap(([id, view]) => {
    const text = objectsOf(id, view);
    return text === "" ? [] : [[id, text].map(encodeURIComponent).join(":")];
  });
  if (objects.length > 0) parts.objects = objects.join(",");
  if (state.selected !== null) parts.tile = encodeURIComponent(state.selected);
  if (state.isolated !== null) parts.only = encodeURIComponent(state.isolated);
  const { box, plane } = state.clip;
  if (box !== null) parts.box = written([...box.min, ...box.max]);
  if (plane !== null && JSON.stringify(plane) !== JSON.stringify(start.clip.plane)) {
    parts.cut = written([...plane.normal, plane.offset_um]);
  }
  if (plane === null && start.clip.plane !== null) parts.cut = UNCUT;
  const [list, newest] = linkedMeasurements(state);
  if (list !== "") parts.measures = list;
  const views = state.keptViews.flatMap(({ position, target }) => [...position, ...target]);
  if (views.length > 0) parts.views = written(views);
  if (newest.length > 0) parts.points = written(newest.flat());
  Object.assign(parts, Object.fromEntries(writeWords(otherParameters(), state, start, WORDS)));
  const light = writeLight(state, start);
  if (light !== "") parts.light = light;
  Object.assign(parts, camera === null ? {} : writeCamera(camera));
  return `#${Object.entries(parts)
    .map(([name, text]) => `${name}=${text}`)
    .join("&")}`;
}

/** Returns the entry of a channel with a changed appearance; an empty list for an unchanged channel. */
function writeChannel(
  channel: ChannelState,
  start: ChannelState | undefined,
  has: HasShapes,
): string[] {
  const opened = { ...channel, ...START_CHANNEL, color: channel.original };
  const parts = writeWords(CHANNEL, channel, opened, CHANNEL_WORDS).map(
    ([letter, word]) => `${letter}${word}`,
  );
  const [low, high] = channel.window;
  if (low !== 0 || high !== 1) parts.push(`w${written([low])}_${written([high])}`);
  const shaped = Object.entries(channel.shapes).filter(([name]) => has(channel, name));
  for (const [name, shapes] of shaped) {
    parts.push(`s${encodeURIComponent(name)}_${writeShapes(shapes)}`);
  }
  // Reading shapes also selects their function, so that the selected one has to be written after them.
  if (shaped.length > 0 || channel.transferFunction !== start?.transferFunction) {
    parts.push(`t${encodeURIComponent(channel.transferFunction)}`);
  }
  return parts.length > 0 ? [[encodeURIComponent(channel.id), ...parts].join(":")] : [];
}

/**
 * Reads a link: returns the actions and the camera that lead from a bundle's opening state to the view.
 *
 * @param hash of the page's address, with its `#`
 * @param specimen its bounds in um, world; cuts and points beyond them are moved to the bounds
 */
export function readLink(hash: string, state: ViewerState, specimen: Box): Shared {
  const text = hash.replace(/^#/, "");
  const refused = (what: string): Shared => ({
    actions: [{ type: "notify", text: `Link: ${what}` }],
    camera: null,
  });
  if (text === "") return { actions: [], camera: null };
  if (text.length > LONGEST)
    return refused(
      `found ${text.length} characters, expected at most ${LONGEST}: copy the link again.`,
    );
  const parts = new Map(
    text.split("&").map((part) => {
      const at = part.indexOf("=");
      return at === -1 ? ([part, ""] as const) : ([part.slice(0, at), part.slice(at + 1)] as const);
    }),
  );
  const version = parts.get("v");
  if (version === undefined)
    return refused(`v is missing after the #, expected v=${VERSION}: copy the whole link again.`);
  if (version !== VERSION) {
    return refused(
      `v is ${shortened(version)}, expected ${VERSION}: open the link with the viewer that wrote it.`,
    );
  }
  return new LinkReader(parts, state, specimen).read();
}

/** Returns a text of an address, shortened for a notice. */
function shortened(text: string): string {
  return text.length > 24 ? `${text.slice(0, 24)} …` : text;
}

/** Returns the decoded text; null if it can't be decoded, for example `%ff`. */
function decoded(text: string): string | null {
  try {
    return decodeURIComponent(text);
  } catch (error) {
    if (error instanceof URIError) return null;
    throw error;
  }
}

class LinkReader {
  private readonly actions: Action[] = [];
  private readonly unread: string[] = [];
  private readonly unknown: string[] = [];

  constructor(
    private readonly parts: ReadonlyMap<string, string>,
    private readonly state: ViewerState,
    private readonly specimen: Box,
  ) {}

  read(): Shared {
    this.readShown();
    this.readAppearances();
    this.readObjects();
    this.readParameters(VOLUMES);
    this.tile("tile", "select");
    this.tile("only", "isolate");
    this.readClip();
    this.readParameters(otherParameters());
    this.readPoints();
    this.readMeasurements();
    this.readViews();
    this.readLight();
    const eye = this.parts.get("eye");
    const camera = eye === undefined ? null : readCamera(eye, this.parts.get("pose") ?? null);
    if (eye !== undefined && camera === null) this.unread.push("eye");
    this.report("this bundle has no", this.unknown);
    this.report("left out parts that can't be read:", this.unread);
    return { actions: this.actions, camera };
  }

  private report(what: string, names: readonly string[]): void {
    if (names.length === 0) return;
    const listed = names.slice(0, 5).join(", ");
    const more = names.length > 5 ? ` and ${names.length - 5} more` : "";
    this.actions.push({ type: "notify", text: `Link: ${what} ${listed}${more}.` });
  }

  private channel(text: string): ChannelState | null {
    const id = decoded(text);
    const channel = this.state.channels.find((each) => each.id === id);
    if (channel === undefined) this.unknown.push(`channel ${shortened(text)}`);
    return channel ?? null;
  }

  private readShown(): void {
    const text = this.parts.get("c");
    if (text === undefined) return;
    const named = text === "" ? [] : text.split(",").flatMap((id) => this.channel(id) ?? []);
    if (text !== "" && named.length === 0) return; // keeps the channels with which the bundle opens
    const wanted = new Set(named.slice(0, MAX_CHANNELS).map(({ id }) => id));
    const show = (shown: boolean) => {
      for (const each of this.state.channels) {
        if (each.shown !== shown && wanted.has(each.id) === shown) {
          this.actions.push({ type: "show", channel: each.id, shown });
        }
      }
    };
    show(false); // hide channels first: the number of shown channels is limited
    show(true);
  }

  private readLight(): void {
    const text = this.parts.get("light");
    if (text === undefined) return;
    readLight(text).forEach((action, i) => {
      if (action !== null) this.actions.push(action);
      else this.unread.push(`light ${shortened(text.split(",")[i])}`);
    });
  }

  private readAppearances(): void {
    const text = this.parts.get("l");
    if (text === undefined) return;
    for (const entry of text.split(",")) {
      const [id, ...words] = entry.split(":");
      const channel = this.channel(id);
      if (channel === null) continue;
      for (const word of words) {
        const action = appearanceAction(channel, word);
        if (action === null) this.unread.push(`l ${shortened(`${channel.id}:${word}`)}`);
        else this.actions.push(action);
      }
    }
  }

  /** Passes on the objects' text; the code that knows the table of objects parses it. */
  private readObjects(): void {
    const text = this.parts.get("objects");
    for (const entry of text ? text.split(",") : []) {
      const [id, words = ""] = entry.split(":");
      const channel = this.channel(id);
      const linked = decoded(words);
      if (linked === null) this.unread.push(`objects ${shortened(words)}`);
      else if (channel !== null) {
        this.actions.push({ type: "objects", channel: channel.id, change: { linked } });
      }
    }
  }

  private readParameters(rows: readonly Parameter<ViewerState>[]): void {
    for (const row of rows) {
      const text = row.link === undefined ? undefined : this.parts.get(row.link);
      if (row.link === undefined || text === undefined) continue;
      const action = readWord(row, text, WORDS);
      if (action === null) this.unread.push(row.link);
      else this.actions.push(action);
    }
  }

  private tile(name: string, type: "select" | "isolate"): void {
    const text = this.parts.get(name);
    if (text === undefined) return;
    const tile = decoded(text);
    if (tile !== null && this.state.tiles.some(({ id }) => id === tile)) {
      this.actions.push({ type, tile });
    } else this.unknown.push(`tile ${shortened(text)}`);
  }

  private readClip(): void {
    const clip: { -readonly [K in keyof Clip]: Clip[K] } = { ...this.state.clip };
    const box = this.parts.get("box");
    const cut = this.parts.get("cut");
    if (box !== undefined) {
      const read = this.boxOf(readNumbers(box, 6));
      if (read === null) this.unread.push("box");
      else clip.box = read;
    }
    if (cut === UNCUT) clip.plane = null;
    else if (cut !== undefined) {
      const [x, y, z, offset_um] = readNumbers(cut, 4) ?? [0, 0, 0, 0];
      const length = Math.hypot(x, y, z);
      if (!(length > 0.5)) this.unread.push("cut");
      else {
        const normal: Vec3 = [x / length, y / length, z / length];
        clip.plane = withinSpecimen(normal, offset_um, this.specimen);
      }
    }
    if (clip.box !== this.state.clip.box || clip.plane !== this.state.clip.plane) {
      this.actions.push({ type: "set-clip", clip });
    }
  }

  private boxOf(values: readonly number[] | null): Box | null {
    if (values === null) return null;
    const [min, max] = [this.within(values.slice(0, 3)), this.within(values.slice(3))];
    return AXES.every((i) => min[i] < max[i]) ? { min, max } : null;
  }

  private readPoints(): void {
    const text = this.parts.get("points");
    if (text === undefined) return;
    const values = readNumbers(text, 6) ?? readNumbers(text, 3);
    if (values === null) this.unread.push("points");
    else {
      const points = [values.slice(0, 3), values.slice(3)].filter(({ length }) => length > 0);
      this.actions.push({ type: "measure", points: points.map((point) => this.within(point)) });
    }
  }

  private readMeasurements(): void {
    const text = this.parts.get("measures");
    if (text === undefined) return;
    const { read, unread } = readMeasurements(text, (point) => this.within(point));
    if (read.length > 0) this.actions.push({ type: "set-measurements", measurements: read });
    for (const entry of unread) this.unread.push(`measures ${shortened(entry)}`);
  }

  private readViews(): void {
    const text = this.parts.get("views");
    if (text === undefined) return;
    const words = text.split(",");
    const views = Array.from({ length: Math.ceil(words.length / 6) }, (_, i) =>
      readCamera(words.slice(6 * i, 6 * i + 6).join(), null),
    ).flatMap((view) => (view === null ? [] : [{ position: view.position, target: view.target }]));
    if (6 * views.length !== words.length) this.unread.push("views");
    else this.actions.push({ type: "keep-views", views });
  }

  /** Returns the nearest point within the specimen's bounds. */
  private within(point: readonly number[]): Vec3 {
    const { min, max } = this.specimen;
    const at = (i: 0 | 1 | 2) => Math.min(Math.max(point[i], min[i]), max[i]);
    return [at(0), at(1), at(2)];
  }
}

function appearanceAction({ id, transferFunctions }: ChannelState, word: string): Action | null {
  const [letter, value] = [word.slice(0, 1), word.slice(1)];
  const row = CHANNEL.find(({ link }) => link === letter);
  if (row !== undefined) return readWord(row, value, CHANNEL_WORDS, id);
  switch (letter) {
    case "w": {
      const ends = readNumbers(value.replace("_", ","), 2);
      return ends && { type: "window", channel: id, window: [ends[0], ends[1]] };
    }
    case "s": {
      const at = value.lastIndexOf("_");
      const name = decoded(value.slice(0, Math.max(0, at)));
      const shapes = readShapes(value.slice(at + 1));
      if (name === null || shapes === null) return null;
      if (name !== OWN && !transferFunctions.includes(name)) return null;
      return { type: "set-shapes", channel: id, name, shapes };
    }
    case "t": {
      const name = decoded(value);
      if (name === null || (name !== OWN && !transferFunctions.includes(name))) return null;
      return { type: "choose-transfer-function", channel: id, name };
    }
    default:
      return null;
  }
}
