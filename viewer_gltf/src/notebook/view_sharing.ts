/**
 * Shares the view with the notebook or the page that contains this one. It sends each change through a port, and shows
 * the changes that it receives. Lengths are in um of the specimen, and windows are in values of the source.
 */
import type { Manifest } from "../bundle/generated/bundle";
import type { PartHost, Tap } from "../host/part";
import type { LinkCode } from "../host/services";
import { fromHex, toHex } from "../math/color";
import type { Ray, Vec3 } from "../math/vec3";
import type { Action } from "../state/actions";
import { initialState } from "../state/initial_state";
import { COLOR, OPACITY } from "../state/parameters/channel";
import { setTo } from "../state/parameters/kinds";
import { isTraced } from "../state/parameters/volumes";
import type { ChannelState } from "../state/viewer_state";

export type SharedChannel = Readonly<{
  visible: boolean;
  /** Colour of the channel as `#rrggbb`. */
  color: string;
  opacity: number;
  /** Low and high end of the channel's window, in values of the source. */
  window: readonly [number, number];
}>;
type SharedView = Readonly<{ eye_um: Vec3; target_um: Vec3 }>;
/** A picked point; `tile`, `channel` and `object` are absent if they were not determined, as for a point from Python. */
export type Picked = Readonly<{
  point_um: Vec3;
  tile?: string;
  channel?: string | null;
  object?: string | null;
}>;
export type Shared = Readonly<{
  link: string;
  channels: Readonly<Record<string, SharedChannel>>;
  view: SharedView;
  picked: Picked | null;
}>;
/** A state that Python requests. Fields that are left out stay as they are. */
export type Asked = Readonly<{
  link?: string;
  channels?: Readonly<Record<string, Partial<SharedChannel>>>;
  view?: Partial<SharedView>;
  picked?: Picked | null;
}>;

/** Least time between two messages, ms. */
const BETWEEN_MS = 200;
/** Time without a change after which a picture is made, ms. */
const REST_MS = 1200;
const POSTER_PX = 960;
/** Smallest number of light samples of a pixel for a picture; with fewer it is too noisy. */
const MIN_SAMPLES = 64;
/** Significant digits of shared numbers; more digits would only show rounding noise of the camera. */
const DIGITS = 6;

const rounded = (value: number) => Number(value.toPrecision(DIGITS));

/** Returns a channel's settings in the form that Python uses. Pure. */
export function sharedChannel(
  channel: ChannelState,
  [low, high]: readonly [number, number],
): SharedChannel {
  const { shown, color, opacity, window } = channel;
  const value = (share: number) => rounded(low + share * (high - low));
  return {
    visible: shown,
    color: toHex(color),
    opacity: rounded(opacity),
    window: [value(window[0]), value(window[1])],
  };
}

/** Returns the actions that apply the requested settings of a channel which differ from the present ones. Pure. */
export function channelActions(
  channel: ChannelState,
  asked: Partial<SharedChannel>,
  range: readonly [number, number],
): readonly Action[] {
  const { id } = channel;
  const now = sharedChannel(channel, range);
  const { visible = now.visible, color = now.color, opacity = now.opacity } = asked;
  const { window = now.window } = asked;
  const actions: Action[] = [];
  if (visible !== now.visible) actions.push({ type: "show", channel: id, shown: visible });
  if (color !== now.color) actions.push(setTo(COLOR, fromHex(color), id));
  if (opacity !== now.opacity) actions.push(setTo(OPACITY, opacity, id));
  if (window.some((value, i) => value !== now.window[i])) {
    const share = (value: number) => (value - range[0]) / (range[1] - range[0]);
    actions.push({ type: "window", channel: id, window: [share(window[0]), share(window[1])] });
  }
  return actions;
}

const isSame = (a: unknown, b: unknown) => JSON.stringify(a) === JSON.stringify(b);

/** A port for messages: to a notebook, or to the page that holds this one in a frame. */
export type Port = Readonly<{
  addEventListener: (type: "message", listener: (event: MessageEvent) => void) => void;
  postMessage: MessagePort["postMessage"];
}>;

export class ViewSharing {
  private picked: Picked | null = null;
  /** The last state that was sent or received. */
  private known: Partial<Shared> = {};
  private timer = 0;
  private rest = 0;
  /** Link to the view of the last picture that was sent. */
  private pictured = "";
  private readonly manifest: Manifest;

  constructor(
    private readonly host: PartHost,
    private readonly port: Port,
    private readonly links: LinkCode,
  ) {
    const { display } = host;
    this.manifest = host.bundle.manifest;
    host.viewpoint.stopTurning(); // each frame of a turning specimen would be a change to send
    host.changed.subscribe(() => this.note());
    host.drawn.subscribe(() => this.note());
    port.addEventListener("message", ({ data }: MessageEvent) => {
      if (data.type === "state") this.sync(data.state);
    });
    port.postMessage({ type: "open" });
    void display.settled().then(() => port.postMessage({ type: "shown" }));
    this.note();
  }

  onTap({ ray }: Tap): void {
    void this.look(ray);
  }

  /** Schedules a message, because the view may have changed. */
  private note(): void {
    if (this.timer === 0) this.timer = window.setTimeout(() => this.sendShared(), BETWEEN_MS);
  }

  private get ranges(): ReadonlyMap<string, readonly [number, number]> {
    return new Map(
      this.manifest.channels.map(({ id, window: [low, high] }) => [id, [low, high] as const]),
    );
  }

  private get shared(): Shared {
    const { host, ranges } = this;
    const { viewpoint } = host;
    const { position, target } = viewpoint.cameraPose;
    const [eye_um, target_um] = [position, target].map((place) => {
      const [x, y, z] = viewpoint.toSpecimen(place).map(rounded);
      return [x, y, z] as const;
    });
    return {
      link: this.links.link(),
      channels: Object.fromEntries(
        host.state.channels.map((channel) => [
          channel.id,
          sharedChannel(channel, ranges.get(channel.id) ?? [0, 1]),
        ]),
      ),
      view: { eye_um, target_um },
      picked: this.picked,
    };
  }

  private sendShared(): void {
    this.timer = 0;
    const now = this.shared;
    const news = Object.entries(now).filter(
      ([name, value]) => !isSame(value, this.known[name as keyof Shared]),
    );
    if (news.length === 0) return;
    this.known = now;
    this.port.postMessage({ type: "state", state: Object.fromEntries(news) });
    clearTimeout(this.rest);
    this.rest = window.setTimeout(() => void this.picture(), REST_MS);
  }

  /** Shows the state that Python requests, and sends the resulting state. */
  private sync(asked: Asked): void {
    const { host } = this;
    this.known = { ...this.known, ...(asked as Partial<Shared>) };
    host.viewpoint.stopTurning();
    this.applyState(asked);
    if (asked.link !== undefined && asked.link !== this.shared.link) {
      this.openLink(asked.link);
      this.applyState(asked);
    }
    if (asked.picked !== undefined && !isSame(asked.picked, this.picked)) {
      this.picked = asked.picked;
      const points = asked.picked === null ? [] : [asked.picked.point_um];
      host.dispatch({ type: "measure", points });
    }
    this.note();
  }

  private applyState(asked: Asked): void {
    const { host, ranges } = this;
    const { viewpoint } = host;
    for (const channel of host.state.channels) {
      const look = asked.channels?.[channel.id];
      const range = ranges.get(channel.id) ?? [0, 1];
      for (const action of look ? channelActions(channel, look, range) : []) {
        host.dispatch(action);
      }
    }
    const { eye_um, target_um } = { ...this.shared.view, ...asked.view };
    if (asked.view !== undefined && !isSame({ eye_um, target_um }, this.shared.view)) {
      const [position, target] = [eye_um, target_um].map((point) => viewpoint.toScene(point));
      const specimen = viewpoint.cameraView?.specimen ?? null;
      viewpoint.lookFrom({ position, target, specimen });
    }
  }

  private openLink(link: string): void {
    const { host } = this;
    host.dispatch({ type: "restore", state: initialState(this.manifest) });
    const { actions, camera } = this.links.read(link, host.state);
    for (const action of actions) host.dispatch(action);
    if (camera !== null) host.viewpoint.lookFrom(camera);
    else host.run("reset");
  }

  private async look(ray: Ray): Promise<void> {
    const hit = this.host.objectAlong(ray);
    const probed = await this.host.reading.probe(ray);
    if (probed === null) return;
    const [x, y, z] = probed.point.map(rounded);
    const { tile } = probed;
    const channel = hit?.channel ?? probed.channel;
    this.picked = { point_um: [x, y, z], tile, channel, object: hit?.object?.label ?? null };
    this.note();
  }

  /** Sends a picture of the view at rest, for the saved notebook. */
  private async picture(): Promise<void> {
    const { display } = this.host;
    await display.settled();
    const { link } = this.shared;
    // If the view has changed since the last message, the next message schedules another picture.
    if (link === this.pictured || link !== this.known.link || this.host.isInStereo) return;
    if (isTraced(this.host.state) && display.snapshot().traced.samples < MIN_SAMPLES) {
      this.rest = window.setTimeout(() => void this.picture(), REST_MS);
      return;
    }
    this.pictured = link;
    const posters = this.host.service("posters");
    if (posters === null) return;
    const blob = await posters.poster(POSTER_PX);
    const png = await blob.arrayBuffer();
    this.port.postMessage({ type: "picture", png }, [png]);
  }
  dispose(): void {
    clearTimeout(this.timer);
    clearTimeout(this.rest);
  }
}
