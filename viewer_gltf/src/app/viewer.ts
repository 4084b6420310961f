/** Ties the state to the GPU: one scene, drawn only when something has changed. */
import { type Matrix4, Quaternion, type Vector2, Vector3, WebGLRenderer } from "three";
import { listenForHandles } from "../annotations/handle_pointer";
import { BundleError, TemporaryError } from "../bundle/errors";
import type { Bundle } from "../bundle/load";
import type { FilmedFile } from "../capture/encode_video";
import { isSameLook, type Look, Navigation, type Stand } from "../interaction/orbit_camera";
import { listenForClicks, rayAhead, rayUnder } from "../interaction/rays";
import type { HandleId } from "../marks/clip_handles";
import { type LampHandle, lampHandles } from "../marks/lamp_handles";
import { type Box, centerOf } from "../math/box";
import { type HandPose, zoomAbout } from "../math/grab";
import { pickTile, shownBox, shownTiles } from "../math/pick";
import type { Ray, Vec3 } from "../math/vec3";
import type { Layout, Lenses, PanelView } from "../panel/controls";
import { chosenTile } from "../panel/sections/tiles";
import type { Backdrop } from "../render/backdrop";
import { StageSize } from "../render/canvas_size";
import { Hybrid } from "../render/gaze_focus";
import { pixelShare } from "../render/pixel_share";
import {
  OVER_FLOOR_M,
  place,
  ROOM_DISTANCE_M,
  ROOM_SIZE,
  UNDER_EYES_M,
  XR_DISTANCE_M,
} from "../render/placement";
import { Room } from "../render/scene";
import type { Theme } from "../render/theme";
import type { CameraView } from "../share/camera_link";
import type { Action } from "../state/actions";
import { announcementOf } from "../state/announce_change";
import { CANT, type Command, STAYS } from "../state/commands";
import { discLimit } from "../state/focus_tiles";
import { isSameView, keyOfChange, nameOfChange } from "../state/history";
import { initialState } from "../state/initial_state";
import type { ObjectView } from "../state/objects";
import { setTo } from "../state/parameters/kinds";
import { ENVIRONMENT } from "../state/parameters/light";
import { SCREEN_STEREO, START_TOOLS } from "../state/parameters/tools";
import { isTraced, SWITCH_DISTANCE } from "../state/parameters/volumes";
import { newNotice, reduce } from "../state/reduce";
import { REFUSED } from "../state/refusals";
import type { ViewerState } from "../state/viewer_state";
import type { Histogram } from "../volumes/transfer_functions_loader";
import type { Profile } from "../xr/cardboard/viewer_profile";
import { ahead } from "../xr/head_pose";
import { Stereo } from "../xr/stereo";
import type { Snapshot } from "./automation_api";
import type { Scene as Filmed } from "./capture";
import { FrameLoop } from "./frame_loop";
import { Contents } from "./scene_contents";
import { Steps } from "./steps";
import { StereoTransition } from "./stereo_transition";

/** Most device pixels to a CSS pixel: a phone's third one costs more than it shows. */
const MAX_PIXEL_RATIO = 2;
/** The switch distance of the opening at least, as a multiple of the eye's from the middle. */
const NEAR_AT_START = 1.1;

/** Before these the place from which the specimen is seen is a step of its own. */
const ENDS_A_LOOK: ReadonlySet<Command> = new Set(["front", "side", "top", "reset", "next-view"]);

const NOTHING_AHEAD = "Nothing is in the middle of the view.";
/** Distance of the eye from an object that it flies to, in the object's lengths, and at least, m. */
const NEAREST_OBJECT = 6;
const NEAREST_OBJECT_M = 0.08;
/** From where else it is looked at: corners, edges and faces of a cube, those in front first. */
const ASIDE = [1, 0, -1].flatMap((z) =>
  [0, 1, -1].flatMap((y) => [0, 1, -1].flatMap((x) => (x || y || z ? [[x, y, z] as const] : []))),
);
const NOTHING_THERE = "Nothing lies there to fly to.";
const BEHIND_OTHERS = "Other objects hide it from all sides: its card shows it alone.";
/** How long one is at least that is brought before the eyes in stereo, m. */
const OBJECT_IN_ROOM_M = 0.15;
const NEXT_KEPT = "“Next kept view” goes through them.";

const NO_LAYOUT: Layout = {
  ...{ title: "", subtitle: "", sections: [], status: "", isHidden: true },
  more: { isOpen: false, opener: { panel: "unfold", section: "more" } },
};

export type Mark = Readonly<{
  state: ViewerState;
  camera: CameraView | null;
  look: Look;
  newest: object | null;
}>;

/** Notice that stands while the graphics driver may still give the picture back. */
export const DROPPED = "The graphics driver has dropped the picture. The page draws it again.";
const WAITING =
  "The host does not answer. The page tries again, and what has loaded stays on screen.";
const OFFLINE =
  "This device is offline. Parts that it has not shown before appear once it is online.";
/** A fault of a file that makes surfaces or volumes finer, where coarse ones show. */
const FINER = /^(channels|volumes)\/\S+\.(glb|ktx2):/;

export class Viewer {
  readonly renderer: WebGLRenderer;
  readonly stereo: Stereo;
  readonly navigation: Navigation;
  state: ViewerState;
  /** The content of a panel in the room; the owner of the panel sets it. */
  layOut: (view: PanelView) => Layout = () => NO_LAYOUT;
  /** What is asked for in stereo and is the page's; whether it was. */
  onCommand: (command: Command) => boolean = () => false;
  /** The phone is in a viewer of other lenses, it was said in stereo. */
  onLenses: (lenses: Lenses) => void = () => undefined;
  /** Of this screen; null: guessed from the browser's name. */
  private perInch: number | null = null;
  /** Announces what a change has brought besides what it shows; the page sets it. */
  onAnnounce: (text: string) => void = () => undefined;
  /** A tap or a key on the flat screen has opened a card, by the control that it begins with; the page sets it. */
  onCard: (control: string) => void = () => undefined;
  /** Where someone has tapped, um; for what stands round the page. */
  onTap: (ray: Ray) => void = () => undefined;
  /** Someone has tapped the flat picture with the tool *Select* (ray in um), or pressed the key for it. */
  onSelect: (ray: Ray, isByKey: boolean) => void = () => undefined;
  /** A second quick tap asks to fly there, so the first one was no selection. */
  onDouble: () => void = () => undefined;
  readonly contents: Contents;
  private readonly room: Room;
  private readonly hybrid: Hybrid;
  private readonly loop: FrameLoop;
  private readonly transition: StereoTransition;
  private readonly size: StageSize;
  private readonly steps: Steps;
  private nextView = 0;
  /** Resolves when the background of the flat picture has come. */
  private dressed: Promise<void> = Promise.resolve();
  private readonly disposed = new AbortController();

  /**
   * @param onState called after every change of the state
   * @param onFrame called after every frame drawn
   */
  constructor(
    readonly bundle: Bundle,
    private readonly stage: HTMLElement,
    private readonly onState: (state: ViewerState) => void,
    onFrame: () => void,
  ) {
    const { manifest } = bundle;
    this.renderer = new WebGLRenderer({
      antialias: false, // the picture's own target is multisampled
      depth: false,
      powerPreference: "high-performance",
    });
    this.renderer.info.autoReset = false;
    stage.append(this.renderer.domElement);
    const gl = this.renderer.getContext() as WebGL2RenderingContext;
    this.state = initialState(manifest, gl.getExtension("EXT_color_buffer_float") !== null);
    const canvas = this.renderer.domElement;

    this.room = new Room(manifest);
    this.hybrid = new Hybrid(manifest);
    this.loop = new FrameLoop({
      renderer: this.renderer,
      stage,
      room: this.room,
      hybrid: this.hybrid,
      bounds: manifest.specimen.bounds_um,
      shown: () => this,
      onFollow: () => this.follow(),
      onFrame,
    });
    this.contents = new Contents({
      bundle,
      renderer: this.renderer,
      picture: this.loop.picture,
      state: this.state,
      view: stage.parentElement ?? stage,
      dispatch: (action, isStep) => this.dispatch(action, isStep),
      announce: (text) => this.onAnnounce(text),
      onAim: (box, isSeen) => this.flyTo(box, isSeen),
      onCard: (control) => {
        if (this.stereo.kind === null) this.onCard(control);
      },
      onChange: () => this.loop.come(),
      onError: (error) => this.report(error),
    });
    const { marks, surfaces, volumes } = this.contents;
    stage.append(...marks.overlayElements);
    this.room.specimen.group.add(surfaces.group, marks.group, this.contents.slices.group);

    this.navigation = new Navigation(canvas, place(manifest.specimen.bounds_um), () =>
      this.loop.change(),
    );
    this.transition = new StereoTransition(this.navigation, this.room.specimen);
    this.stereo = new Stereo(this.renderer, {
      scene: this.room.scene,
      specimen: this.room.specimen,
      tiles: manifest.tiles,
      handles: [marks.target],
      layOut: (view) => this.layOut(view),
      onAction: (action) => this.dispatch(action),
      onCommand: (command) => {
        if (!this.run(command) && !this.onCommand(command)) this.stereo.announce(CANT);
      },
      onLenses: (lenses) => this.onLenses(lenses),
      onChoose: (ray, tile, isByGaze) => this.choose(ray, tile, isByGaze),
      objectAlong: (ray) => {
        const met = this.contents.objects.meet(ray);
        return met && { id: `${met.channel}/${met.row}`, distance: met.distance };
      },
      onStart: () => this.enterStereo(),
      onEnd: () => this.leaveStereo(),
    });
    this.steps = new Steps(
      () => ({ state: this.state, camera: this.cameraView, isInRoom: this.stereo.kind !== null }),
      this.disposed.signal,
    );
    this.navigation.controls.addEventListener("start", () => this.steps.note());
    const rayAt = (point: Vector2) =>
      rayUnder(this.withinEye(point), this.navigation.camera, this.room.specimen.group);
    const { signal } = this.disposed;
    listenForHandles(
      stage,
      canvas,
      {
        pick: (point, pointing) =>
          this.stereo.kind === null ? marks.pick(rayAt(point), pointing) : null,
        drag: (id, point) => marks.drag(id, rayAt(point)),
        mean: (id) => marks.mean(id),
      },
      signal,
    );
    listenForClicks(
      canvas,
      (point) => {
        if (this.stereo.kind === null) this.tap(rayAt(point));
      },
      (point) => {
        if (this.stereo.kind !== null) return;
        this.onDouble();
        if (this.state.tool === "measure") this.tap(rayAt(point));
        else void this.flyAlong(rayAt(point));
      },
    );
    canvas.addEventListener("webglcontextlost", () => {
      this.dispatch({ type: "notify", text: DROPPED });
      volumes.forget(); // their texels went with the context
      this.contents.traced.forget();
      this.loop.forget();
    });
    canvas.addEventListener("webglcontextrestored", () => {
      volumes.forget(); // those that have come since
      this.contents.traced.forget();
      this.loop.renew(); // the times that were asked for went, too
      this.follow();
      this.dispatch({ type: "dismiss", texts: [DROPPED] });
    });
    addEventListener("online", () => this.retry(), { signal });
    this.size = new StageSize(stage, () => this.fit());
    this.fit();
    this.follow();
    this.loop.start();
  }

  /** @param isStep whether undoing goes back to before it */
  dispatch(action: Action, isStep = action.type !== "restore"): void {
    const next = reduce(this.state, action);
    if (next === this.state) return;
    const notice = newNotice(this.state, next);
    const announcement = announcementOf(this.state, next, this.bundle.manifest.tiles);
    const before = this.lamps.length;
    const larger = next.specimenSize_m / this.state.specimenSize_m;
    if (isStep && !isSameView(this.state, next)) {
      this.steps.add(nameOfChange(action, this.state), keyOfChange(action));
    }
    this.state = next;
    if (larger !== 1) this.stereo.resize(larger, next);
    if (notice !== null) this.stereo.announce(notice);
    if (announcement !== null) this.onAnnounce(announcement);
    this.follow();
    if (this.lamps.length > before) this.bringLampsInSight();
    this.onState(next);
  }

  /** Do what is no change of the state; whether this was one of the viewer's commands. */
  run(command: Command): boolean {
    const { state } = this;
    const before = this.stereo.kind === null ? this.navigation.lookNow : null;
    const isDone = this.carryOut(command);
    const stays = STAYS[command];
    const isSame = this.state === state && before !== null && isSameLook(before, this.navigation);
    if (isDone && isSame && stays !== undefined) this.onAnnounce(stays);
    return isDone;
  }

  private carryOut(command: Command): boolean {
    if (ENDS_A_LOOK.has(command)) this.steps.note();
    switch (command) {
      case "undo":
      case "redo":
        return this.step(command);
      case "keep-view":
      case "next-view":
      case "forget-views":
        if (!this.keepViews(command)) return false;
        break;
      case "reset":
        this.dispatch({ type: "isolate", tile: null });
        this.recentre();
        this.navigation.reset();
        break;
      case "back":
        if (this.state.isolated !== null) this.dispatch({ type: "isolate", tile: null });
        else this.dispatch({ type: "select", tile: null });
        break;
      case "retry":
        this.retry();
        break;
      case "press":
        if (this.stereo.kind !== null) return this.stereo.run(command, this.state);
        if (!this.tap(rayAhead(this.loop.head, this.room.specimen.group), true)) {
          this.onAnnounce(NOTHING_AHEAD);
        }
        break;
      default: {
        const isInRoom = this.stereo.kind !== null;
        const isDone = isInRoom
          ? this.stereo.run(command, this.state)
          : this.navigation.run(command);
        if (!isDone) return false;
      }
    }
    this.loop.change();
    return true;
  }

  /** What the screen shows as a PNG, so many times as large; null: it was left. Rejects with a DOMException. */
  async picture(
    scale: number,
    onPart: (words: string) => void,
    signal: AbortSignal,
  ): Promise<Blob | null> {
    const { savePicture } = await this.loadCapture();
    return savePicture(this.filmed, scale, onPart, signal);
  }

  /** Through the kept views, or once round; null: it was left. Rejects with a DOMException. */
  async film(
    onSecond: (done: number, of: number) => void,
    signal: AbortSignal,
  ): Promise<FilmedFile | null> {
    const { saveVideo } = await this.loadCapture();
    const before = this.cameraView;
    try {
      return await saveVideo(this.filmed, this.state.keptViews, onSecond, signal);
    } finally {
      this.transition.restore(before);
    }
  }

  /** What the screen shows, no larger than so many pixels, as soon as can be. Rejects with a DOMException. */
  async poster(longest_px: number): Promise<Blob> {
    const { posterOf } = await this.loadCapture();
    return posterOf(this.filmed, longest_px);
  }

  /** From um to the room. */
  get specimen(): Matrix4 {
    return this.room.specimen.group.matrixWorld;
  }

  private loadCapture() {
    return import("./capture").catch((cause) => {
      throw new DOMException(
        `the part of the page for it could not be loaded (${cause})`,
        "NetworkError",
      );
    });
  }

  private get filmed(): Filmed {
    const { renderer, navigation, loop: studio, stage } = this;
    return {
      renderer,
      navigation,
      studio,
      height_px: stage.clientHeight,
      specimen: this.specimen,
      labelled: this.room.specimen.group,
      state: this.state,
      manifest: this.bundle.manifest,
      colorsOf: (channel) => this.contents.objects.legend(channel),
    };
  }

  /** The flat camera's views that were kept: one more, on to the next one, none. */
  private keepViews(command: "keep-view" | "next-view" | "forget-views"): boolean {
    const { keptViews } = this.state;
    if (this.stereo.kind !== null) return false;
    if (command === "next-view") {
      const next = keptViews[this.nextView++ % Math.max(1, keptViews.length)];
      if (next !== undefined) this.navigation.lookFrom(next);
      return next !== undefined;
    }
    const views = command === "forget-views" ? [] : [...keptViews, this.navigation.lookNow];
    this.nextView = 0;
    this.dispatch({ type: "keep-views", views });
    const { length } = this.state.keptViews;
    this.onAnnounce(
      length === 0 ? "No view is kept any more." : `${length} views are kept: ${NEXT_KEPT}`,
    );
    return true;
  }

  private step(command: "undo" | "redo"): boolean {
    const found = command === "undo" ? this.steps.undo() : this.steps.redo();
    if (found === null) {
      this.onAnnounce(REFUSED[command]);
      return true;
    }
    const { state, camera, isInRoom } = found.moment;
    this.dispatch({ type: "restore", state });
    // in a room the head looks, and what stands there was put there
    if (!isInRoom && this.stereo.kind === null) this.transition.restore(camera);
    this.loop.change();
    this.onAnnounce(`${command === "undo" ? "Undone" : "Redone"}: ${found.name}.`);
    this.onState(this.state);
    return true;
  }

  /** What undoing would change; null: nothing. */
  get undoes(): string | null {
    return this.steps.undoes;
  }

  get redoes(): string | null {
    return this.steps.redoes;
  }

  /** A moment that `takeBack` can return to. */
  get mark(): Mark {
    const { state, cameraView: camera } = this;
    return { state, camera, look: this.navigation.lookNow, newest: this.steps.newest };
  }

  /** Whether the user would see a difference since then. */
  hasChangedSince({ state, look }: Mark): boolean {
    return !isSameView(state, this.state) || !isSameLook(look, this.navigation);
  }

  /** The newest step of the history. */
  get newestStep(): object | null {
    return this.steps.newest;
  }

  /** Return to the state of a moment and to where the specimen was seen from. */
  takeBack({ state, camera, newest }: Mark): void {
    if (!isSameView(state, this.state)) {
      // a change that was joined with the step before it made no step of its own
      for (let left = Math.max(1, this.steps.since(newest)); left > 0; left--) this.step("undo");
    }
    if (this.stereo.kind === null) this.transition.restore(camera);
    this.loop.change();
    this.onState(this.state);
  }

  /** From here on: what came before was no user's. */
  forgetSteps(): void {
    this.steps.forget();
    this.onState(this.state);
  }

  /** Lamps may be beside and behind the eye. In stereo the head finds them. */
  private bringLampsInSight(): void {
    if (this.stereo.kind !== null) return;
    const { matrixWorld } = this.room.specimen.group;
    this.navigation.stepBackFor(
      this.lamps.map(({ position }) => new Vector3(...position).applyMatrix4(matrixWorld)),
    );
  }

  /** Those that can be taken hold of. */
  private get lamps(): readonly LampHandle[] {
    return lampHandles(this.state, this.bundle.manifest.specimen.bounds_um);
  }

  /** Light up a handle of the cuts or of the lamps; null: none. */
  mean(handle: HandleId | null): void {
    this.contents.marks.mean(handle);
  }

  /** Frames drawn so far. */
  get frames(): number {
    return this.loop.frames;
  }

  /** From where the specimen is seen; null: as it opens. */
  get cameraView(): CameraView | null {
    return this.transition.cameraView;
  }

  /**
   * Open the view: as the address has it, or with what there is of the specimen in the picture, near
   * enough for volumes, and slowly turning until someone touches it.
   */
  openWith(stand: Stand | null, saysDistance: boolean): void {
    const { navigation } = this;
    this.fit(); // the panel has its place by now
    if (stand !== null) navigation.openAt(stand);
    else {
      const away_m = NEAR_AT_START * navigation.openingDistance_m;
      const isFar = away_m > this.state.switchDistance_m;
      if (isFar && !saysDistance) this.dispatch(setTo(SWITCH_DISTANCE, away_m));
      // light is gathered while nothing moves
      const isCalm = matchMedia("(prefers-reduced-motion: reduce)").matches;
      if (!isCalm && !isTraced(this.state)) navigation.turnSlowly();
    }
    this.loop.change();
  }

  get cssPixelsPerInch(): number | null {
    return this.perInch;
  }

  /** @param perInch CSS pixels in an inch of this screen; null: guessed from the browser's name */
  setScreen(perInch: number | null): void {
    this.perInch = perInch;
    this.follow();
  }

  /**
   * The background of the flat picture; the specimen has the same colours before all of them.
   *
   * @param isPlain one colour and no shadow: for cutting out, and for readers who ask for more contrast
   */
  dress(theme: Theme, isPlain: boolean): void {
    const dressIn = (backdrop: Backdrop | null) => {
      this.room.dress(theme, backdrop);
      this.loop.change();
    };
    dressIn(null);
    const fetched = isPlain ? Promise.resolve() : import("../render/backdrop");
    const dressed: Promise<void> = fetched.then(
      (part) => {
        if (part && this.dressed === dressed) dressIn(new part.Backdrop());
      },
      () => undefined, // a picture without it is as true
    );
    this.dressed = dressed;
  }

  /** Someone has touched the page. */
  stopTurning(): void {
    this.navigation.stopTurning();
  }

  lookFrom(view: CameraView): void {
    this.transition.lookFrom(view);
    this.loop.change();
  }

  snapshot(): Snapshot {
    const { surfaces, volumes } = this.contents;
    return {
      state: this.state,
      look: this.navigation.lookNow,
      hasFirstPicture: surfaces.hasFirst,
      overview: surfaces.overview,
      isLoading: this.contents.isLoading,
      triangles: surfaces.triangles,
      drawCalls: this.renderer.info.render.calls,
      volumes: volumes.status(),
      volumeBytes: volumes.bytes,
      traced: this.contents.traced.status(),
      gazed: this.hybrid.focusTiles.focusTile,
      discRadius_deg: (this.hybrid.outer_rad * 180) / Math.PI,
      discLimit_deg: discLimit(this.hybrid.focusTiles, this.state.discRadius_deg),
      frame_ms: this.loop.frame_ms,
      settings: this.loop.settings,
      measuredValues: this.contents.marks.values,
      gpuObjects: {
        ...this.renderer.info.memory,
        programs: this.renderer.info.programs?.length ?? 0,
      },
      isStereo: this.stereo.kind !== null,
      specimenAt: this.room.specimen.middle,
      specimenTurn: this.room.specimen.pose.orientation.toArray(),
      told: this.stereo.hands?.notice.texts ?? [],
      menu: this.stereo.menu,
    };
  }

  /** Resolves when nothing loads any more and the picture shows all of it. */
  async settled(): Promise<void> {
    await this.dressed;
    return this.loop.settled();
  }

  /** Resolves when the next frame has been drawn. */
  nextFrame(): Promise<void> {
    return this.loop.nextFrame();
  }

  /** Draw volumes of at most so many voxels along a tile's edge. */
  limitEdge(edge: number): void {
    this.contents.limitEdge(edge);
    this.follow();
  }

  /** Pose of the head in the room, or of the mono camera. */
  get head(): Matrix4 {
    return this.loop.head;
  }

  report(error: unknown): void {
    if (!(error instanceof BundleError)) throw error;
    const isOffline = navigator.onLine === false;
    if (isOffline && FINER.test(error.message) && !this.isIncomplete) return;
    const isMendable = isOffline || error instanceof TemporaryError;
    const text = isOffline
      ? OFFLINE
      : error instanceof TemporaryError
        ? error.notice
        : error.message;
    // it would be reported again for each of a host's files
    if (isMendable && this.state.mendable.includes(text)) return;
    this.dispatch({ type: "notify", text, isMendable });
  }

  /**
   * Shows a notice while files are awaited. A device without a network gets it only if the picture is incomplete.
   *
   * @param files number of files that wait for another try; 0 takes the notice away
   */
  noteWaiting(files: number): void {
    const text = navigator.onLine ? WAITING : OFFLINE;
    // A file that was awaited in vain keeps its notice until it arrives.
    const passing = [WAITING, OFFLINE].filter((each) => !this.state.mendable.includes(each));
    if (files === 0) this.dispatch({ type: "dismiss", texts: passing });
    else if (this.state.notices.includes(text)) return;
    else if (navigator.onLine ? files === 1 : this.isIncomplete) {
      this.dispatch({ type: "notify", text });
    }
  }

  /** Whether a part of the picture is missing, not merely coarse. */
  private get isIncomplete(): boolean {
    const { surfaces, volumes } = this.contents;
    return !surfaces.overview.isComplete || volumes.isIncomplete;
  }

  /** Light the traced picture by a file of the user's. Throws BundleError. */
  async lightBy(file: File): Promise<void> {
    await this.contents.traced.lightBy(file);
    this.dispatch(setTo(ENVIRONMENT, "own"));
  }

  /** Voxels of a channel by value and gradient; null: not yet, it is being fetched. */
  histogram(channel: string): Histogram | null {
    return this.contents.transferFunctions2d.histogram(channel);
  }

  /** The panel's sections of the label maps that are shown. */
  get objects() {
    return this.contents.objects.facts;
  }

  /** The objects that are meant, as a table for each label map; null: it is on its way. */
  objectsCsv() {
    return this.contents.objects.csv();
  }

  /** What a link says of a channel's objects; "": nothing. */
  readonly linkedObjects = (channel: string, view: ObjectView): string =>
    this.contents.objects.linked(channel, view)?.text ?? view.linked;

  /** Objects of lists that are too long for a link. */
  get leftOutOfLink(): number {
    const { objects } = this.contents;
    return Object.entries(this.state.objects).reduce(
      (sum, [id, view]) => sum + (objects.linked(id, view)?.leftOut ?? 0),
      0,
    );
  }

  /** The channels' values where the slices meet, in the source's units; none: no slices show. */
  get sliceValues(): readonly string[] {
    return this.contents.slices.values;
  }

  /** Ask again for all that has failed. */
  private retry(): void {
    this.dispatch({ type: "dismiss", texts: this.state.mendable });
    this.contents.retryFailed();
    this.follow();
  }

  /** Must be called from a tap. Throws BundleError in words if the browser or the user refuses. */
  async startSplit(profile: Profile): Promise<void> {
    const problems = await this.stereo.startSplit(profile);
    for (const text of problems) this.dispatch({ type: "notify", text });
  }

  private follow(): void {
    const { isolated, selected, quality, eyeDistance_mm, stereoStrength } = this.state;
    this.stereo.setEyes({
      distance_m: eyeDistance_mm / 1000,
      strength: stereoStrength,
      cssPixelsPerInch: this.perInch,
    });
    const { manifest } = this.bundle;
    this.room.specimen.show(isolated === null ? null : shownBox(manifest, isolated));
    this.followScreenStereo();
    this.contents.follow(this.state, this.hybrid);
    this.room.mark(isolated === null ? selected : null);
    this.loop.setLevel(quality);
    this.loop.change();
  }

  /** Bring the page's own screen to the stereo that is asked for. */
  private followScreenStereo(): void {
    const { screenStereo } = this.state;
    if (this.stage.dataset.stereo === screenStereo) return;
    this.stage.dataset.stereo = screenStereo;
    this.stereo.showOnScreen(screenStereo).then(
      () => this.loop.change(),
      (error) => {
        this.report(error);
        this.dispatch(setTo(SCREEN_STEREO, "off"), false);
      },
    );
    this.fit();
  }

  /** A point of the screen, -1..1, in the picture of the eye that shows there. */
  private withinEye(point: Vector2): Vector2 {
    if (this.state.screenStereo !== "side-by-side") return point;
    return point.clone().setX(2 * point.x + (point.x < 0 ? 1 : -1));
  }

  private fit(): void {
    if (this.renderer.xr.isPresenting) return;
    const { clientWidth, clientHeight } = this.stage;
    if (clientWidth === 0 || clientHeight === 0) return;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, MAX_PIXEL_RATIO) * pixelShare());
    this.renderer.setSize(clientWidth, clientHeight);
    const style = getComputedStyle(this.stage);
    const share = (name: string) => Number.parseFloat(style.getPropertyValue(name)) / clientHeight;
    const covered = { top: share("--over-top") || 0, bottom: share("--over-bottom") || 0 };
    const pictures = this.state.screenStereo === "side-by-side" ? 2 : 1;
    this.navigation.fit(clientWidth / pictures / clientHeight, covered);
    this.loop.change();
  }

  /** The specimen where it opens: in stereo straight before the head, at its height. */
  private recentre(): void {
    const { specimen } = this.room;
    const head = this.stereo.recentre();
    if (head === null) specimen.goHome();
    else if (this.stereo.isInUsersRoom) {
      const { position, orientation } = this.tableBefore(head);
      specimen.anchorAt(position, ROOM_SIZE, orientation);
    } else specimen.anchorAt(ahead(head, XR_DISTANCE_M));
  }

  /** Where things stand in the user's own room, facing a head. */
  private tableBefore(head: Matrix4): HandPose {
    const position = ahead(head, ROOM_DISTANCE_M);
    const eye = new Vector3().setFromMatrixPosition(head);
    const heading = Math.atan2(eye.x - position.x, eye.z - position.z);
    const { hasFloor } = this.stereo.headset;
    const height_m = hasFloor ? OVER_FLOOR_M : eye.y - UNDER_EYES_M;
    const orientation = new Quaternion().setFromAxisAngle(new Vector3(0, 1, 0), heading);
    return { position: position.setY(height_m), orientation };
  }

  /**
   * Bring an object near: the flat camera goes there, to where nothing lies before it, if there is such a place;
   * in stereo it comes before the eyes.
   */
  private flyTo(box: Box, isSeen: (eye: Vec3) => boolean): void {
    const { specimen } = this.room;
    const toSpecimen = specimen.group.matrixWorld.clone().invert();
    const middle = new Vector3(...centerOf(box)).applyMatrix4(specimen.group.matrixWorld);
    const edge_m = specimen.scale * Math.max(...box.max.map((v, i) => v - box.min[i]));
    if (this.stereo.kind === null) {
      const { position, target } = this.navigation.lookNow;
      const distance_m = Math.max(NEAREST_OBJECT * edge_m, NEAREST_OBJECT_M);
      const now = new Vector3(...position).sub(new Vector3(...target));
      const eyes = [now, ...ASIDE.map((way) => new Vector3(...way))].map((way) =>
        way.setLength(distance_m).add(middle),
      );
      const free = eyes.find((eye) => isSeen(eye.clone().applyMatrix4(toSpecimen).toArray()));
      if (free === undefined) this.onAnnounce(BEHIND_OTHERS);
      const { x, y, z } = free ?? eyes[0];
      this.navigation.lookFrom({ position: [x, y, z], target: middle.toArray() });
    } else {
      const larger = Math.max(1, OBJECT_IN_ROOM_M / edge_m);
      const pose = zoomAbout(specimen.pose, middle, larger);
      pose.position.add(specimen.anchor).sub(middle);
      specimen.jumpTo(pose, new Vector3().setFromMatrixPosition(this.loop.head));
    }
    this.loop.change();
  }

  /** Flies to what a ray (um) meets. Where it meets nothing the view stays, and the page says so. */
  private async flyAlong(ray: Ray): Promise<void> {
    const met = await this.contents.marks.probe(ray);
    if (this.disposed.signal.aborted) return;
    if (met === null) {
      this.onAnnounce(NOTHING_THERE);
      return;
    }
    this.steps.note();
    this.navigation.flyTowards(new Vector3(...met.point).applyMatrix4(this.specimen));
    this.loop.change();
  }

  private enterStereo(): void {
    const { isInUsersRoom, head } = this.stereo;
    const table = isInUsersRoom && head !== null ? this.tableBefore(head) : null;
    const { specimen } = this.room;
    this.transition.enter(this.state.specimenSize_m / START_TOOLS.specimenSize_m, table);
    specimen.isJumping = true;
    specimen.takeJump(); // there is no picture yet to fade from
    this.onState(this.state);
  }

  private leaveStereo(): void {
    this.room.specimen.isJumping = false;
    this.transition.leave();
    this.fit();
    this.onState(this.state);
  }

  /** A tap on the flat picture: measure, or select what lies there. Returns whether it met anything. */
  private tap(ray: Ray, isByKey = false): boolean {
    this.onTap(ray);
    if (this.measures(ray)) return true;
    const { isolated, clip } = this.state;
    const { tiles } = this.bundle.manifest;
    const hasObject = this.contents.objects.choose(ray, false);
    const tile = pickTile(ray, shownTiles(tiles, isolated), clip)?.id ?? null;
    // a single tile has no others to be told apart from
    if (!hasObject && tiles.length > 1 && tile !== null) this.dispatch({ type: "select", tile });
    this.onSelect(ray, isByKey);
    return hasObject || tile !== null;
  }

  /**
   * In stereo this measures, or chooses the tile; a specimen of a single tile has nothing to choose. A choice by a
   * resting gaze is no step that *Undo* takes back, since nobody asked for it.
   */
  private choose(ray: Ray, tile: string | null, isByGaze: boolean): void {
    const { state } = this;
    if (this.measures(ray) || this.contents.objects.choose(ray, isByGaze)) return;
    if (state.isolated === null && tile !== null) {
      this.dispatch(chosenTile(state, tile), !isByGaze);
    }
  }

  private measures(ray: Ray): boolean {
    if (this.state.tool !== "measure") return false;
    void this.contents.marks.measure(ray);
    return true;
  }

  dispose(): void {
    this.loop.stop();
    this.size.dispose();
    this.disposed.abort();
    this.stereo.dispose();
    this.navigation.dispose();
    this.contents.dispose();
    this.loop.dispose();
    this.renderer.dispose();
    this.renderer.domElement.remove();
  }
}
