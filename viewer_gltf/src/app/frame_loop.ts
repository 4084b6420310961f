/** Draws frames, only when something has changed, each as well as its budget allows. */
import { type Camera, type Matrix4, Vector3, type WebGLRenderer } from "three";
import type { Bounds } from "../bundle/generated/bundle";
import type { Navigation } from "../interaction/orbit_camera";
import { rayAhead } from "../interaction/rays";
import type { Vec3 } from "../math/vec3";
import { type FramePace, Picture } from "../render/frame_renderer";
import type { Hybrid } from "../render/gaze_focus";
import { Pace } from "../render/pacing/frame_budget";
import { RestPace } from "../render/pacing/redraw_at_rest";
import { GatherPace } from "../render/pacing/samples_per_frame";
import type { Room } from "../render/scene";
import { isTraced } from "../state/parameters/volumes";
import type { QualityLevel, QualitySettings } from "../state/quality_controller";
import { marchedTile } from "../state/representation";
import type { ViewerState } from "../state/viewer_state";
import { ERROR_TARGET_PX } from "../surfaces/surface_set";
import { MAX_STEPS, REST_STEPS } from "../volumes/march_frame";
import type { Stereo } from "../xr/stereo";
import { Pulse } from "./pulse";
import type { Contents } from "./scene_contents";

/** Most frames of a picture that is saved that are averaged, where it is marched. */
const MAX_SAMPLES = 64;
/** Samples of each pixel where it is traced: with so many nothing has to be denoised. */
export const TRACED_SAMPLES = 192;
/** Between two looks at whether all has come, ms. */
const POLL_MS = 20;
/** Longest time that a frame counts, s: nobody looked at a page that slept. */
const LONGEST_FRAME_S = 0.1;
/**
 * The same for fades and notices, after a frame that was drawn and took as long: on a slow device, too, they end
 * when they shall.
 */
const LONGEST_FADE_S = 1;

/** Pixels of the volumes, as a share of the picture's along an edge: with fewer they are blocks. */
const MIN_TURNING = 0.5;

export type FrameOptions = Readonly<{
  renderer: WebGLRenderer;
  stage: HTMLElement;
  room: Room;
  hybrid: Hybrid;
  /** Of the specimen, um. */
  bounds: Bounds;
  /** What the frames are of; made after the loop, which gives it what its shaders share. */
  shown: () => Readonly<{
    contents: Contents;
    stereo: Stereo;
    navigation: Navigation;
    state: ViewerState;
  }>;
  /** Something is shown otherwise by what has come, or by where the gaze went. */
  onFollow: () => void;
  /** Called after every frame drawn. */
  onFrame: () => void;
}>;

/** How far a picture that is saved has come. */
export type Still = Readonly<{
  frames: number;
  isDone: boolean;
  /** Of each pixel, where it is traced; null: it is not. */
  samples: number | null;
}>;

export class FrameLoop {
  readonly picture: Picture;
  private readonly pulse: Pulse;
  /** Frames drawn so far. */
  frames = 0;
  private readonly gl: WebGL2RenderingContext;
  private pace: Pace;
  private readonly gathering: GatherPace;
  private readonly resting: RestPace;
  private last_ms = 0;
  /** Whether what is looked at, or from where, has changed since the last frame. */
  private isStale = true;
  /** Whether something has come for the picture since the last frame, which may be at rest. */
  private hasCome = false;
  /** Whether the frame before was one of a moving picture, drawn in its budget. */
  private wasMoving = false;
  /** Whether the last turn of the page drew a frame. */
  private hasDrawn = false;
  private waiting: (() => void)[] = [];
  private readonly pixel = new Uint8Array(4);
  private readonly eye = new Vector3();
  private drawn: (() => void)[] = [];

  constructor(private readonly options: FrameOptions) {
    const { renderer, room, hybrid } = options;
    this.gl = renderer.getContext() as WebGL2RenderingContext;
    this.pulse = new Pulse(renderer, (time_ms) => this.frame(time_ms));
    this.picture = new Picture(renderer, room, hybrid);
    this.pace = new Pace(this.gl);
    this.gathering = new GatherPace(this.gl);
    this.resting = new RestPace(this.gl);
  }

  start(): void {
    this.pulse.start();
  }

  /** What is looked at, or from where, is another: the picture has to follow at once. */
  change(): void {
    this.isStale = true;
    this.pulse.wake();
  }

  /** Something has come for the picture, which may be at rest. */
  come(): void {
    this.hasCome = true;
    this.pulse.wake();
  }

  setLevel(level: QualityLevel): void {
    this.pace.setLevel(level);
  }

  /** Between the last two frames of a moving picture, smoothed. */
  get frame_ms(): number {
    return this.pace.frame_ms;
  }

  /** The settings of the last frame. */
  get settings(): QualitySettings {
    return this.pace.settings;
  }

  /** Resolves when nothing loads any more and the picture shows all of it. */
  settled(): Promise<void> {
    this.pulse.wake();
    return new Promise((resolve) => this.waiting.push(resolve));
  }

  /** Resolves when the next frame has been drawn. */
  nextFrame(): Promise<void> {
    return new Promise((resolve) => this.drawn.push(resolve));
  }

  /** The graphics context is gone, and the times that were asked of it. */
  forget(): void {
    this.gathering.forget();
    this.resting.forget();
  }

  /** There is a graphics context again. */
  renew(): void {
    this.pace = new Pace(this.gl);
  }

  /** Pose of the head, or of the mono camera. */
  get head(): Matrix4 {
    const { stereo, navigation } = this.options.shown();
    return stereo.head ?? navigation.camera.matrixWorld;
  }

  /** Whether nothing more is to be drawn until something changes. */
  private frame(time_ms: number): boolean {
    const { renderer, hybrid, onFollow, onFrame } = this.options;
    if (renderer.getContext().isContextLost()) return true; // there is nothing to draw on
    const { contents, stereo } = this.options.shown();
    const interval_ms = time_ms - this.last_ms;
    const passed_s = Math.max(0, interval_ms / 1000);
    const dt_s = Math.min(LONGEST_FRAME_S, passed_s);
    const fade_s = Math.min(this.hasDrawn ? LONGEST_FADE_S : LONGEST_FRAME_S, passed_s);
    this.last_ms = time_ms;
    this.hasDrawn = false;
    const wasLoading = contents.isLoading;
    if (contents.hasJustBegun()) onFollow();
    const inRoom = stereo.pose(this.picture.eyes);
    this.picture.isSeeThrough = stereo.isInUsersRoom;
    const isStereo = inRoom !== null;
    const camera = inRoom ?? this.poseMono(Math.max(0, interval_ms) / 1000);
    if (isStereo) stereo.hands?.update(dt_s, this.head, this.options.shown().state, fade_s);
    const { isChanging, isFading } = this.advance(dt_s, fade_s);
    const isGathering = contents.traced.isGathering && this.gathering.isReady(time_ms);
    const isDue = this.resting.isDue(time_ms) && this.hasCome;
    const isMoving = isStereo || this.isStale;
    // a picture that came to rest is drawn once more, as well as can be
    const isWanted = isMoving || this.wasMoving || isGathering || isDue;
    // "High" and "low" are alike in all frames
    const canGather = this.options.shown().state.quality === "auto" && this.picture.canGather;
    const gathers = !isWanted && canGather && this.resting.isDue(time_ms);
    // someone waits: what is missing is looked for, and a picture that shows all is not drawn again
    const isAwaited = this.waiting.length > 0;
    if (!isWanted && !gathers && !wasLoading && !this.hasCome && !isAwaited) {
      return !canGather && !contents.traced.isGathering;
    }
    const settings = this.pace.begin(isMoving, interval_ms, stereo.headset.rate_hz);
    // too slow a device to turn the specimen by itself shows it at rest, as well as can be
    if (settings.resolution < MIN_TURNING) this.options.shown().navigation.stopTurning();
    this.picture.marchFrame.uSteps.value = stepsOf(this.options.shown().state) ?? settings.steps;
    hybrid.radiusShare = settings.discShare;
    const [eye] = this.picture.eyes.all; // a headset has none before its first pose
    if (eye !== undefined) {
      const { z, w } = eye.viewport;
      contents.stream(stereo.seenBy(camera), z, w, ERROR_TARGET_PX * settings.errorFactor);
    }
    if (isWanted || gathers) {
      this.isStale = isChanging;
      this.hasCome = isFading;
      contents.surfaces.dressAll();
      const { passes } = this.gathering;
      // late frames give up smooth edges first
      const isSmooth = !isMoving || settings.steps >= MAX_STEPS;
      this.draw({ resolution: settings.resolution, isMoving, passes, isSmooth, gathers });
      if (isGathering) this.gathering.submit(time_ms);
      if (!isMoving) this.resting.submit(time_ms);
      this.frames++;
      this.hasDrawn = true;
      onFrame();
      for (const resolve of this.drawn.splice(0)) resolve();
    }
    this.pace.end();
    this.wasMoving = isMoving;
    const isAtRest = isStereo || (!isMoving && !this.hasCome);
    if (this.waiting.length > 0 && !contents.isLoading && !this.isStale && isAtRest) {
      for (const resolve of this.waiting.splice(0)) resolve();
    }
    return false;
  }

  /** Keep from drawing while a job draws by `drawStill`. */
  async apart<T>(job: () => Promise<T>): Promise<T> {
    this.stop();
    try {
      return await job();
    } finally {
      this.start();
      this.change();
    }
  }

  /** Follow the flat camera, without drawing. */
  follow(dt_s: number): void {
    const camera = this.poseMono(dt_s);
    this.advance(dt_s);
    const { width, height } = this.options.renderer.domElement;
    const { contents } = this.options.shown();
    if (contents.hasJustBegun()) this.options.onFollow();
    contents.stream(camera, width, height, ERROR_TARGET_PX);
  }

  /** Follow the flat camera until what it sees has come, for so long at most. */
  async arrive(dt_s: number, most_ms: number): Promise<void> {
    const start_ms = performance.now();
    this.follow(dt_s);
    while (this.options.shown().contents.isLoading && performance.now() - start_ms < most_ms) {
      await new Promise((resolve) => setTimeout(resolve, POLL_MS));
      this.follow(0);
    }
  }

  /**
   * The flat camera's view, at once: samples are gathered for so long, but for the quality Low or High.
   *
   * @param begun what it has returned for the same view, to go on with
   */
  drawStill(most_ms: number, begun: Still | null = null): Still {
    const { contents, state } = this.options.shown();
    const { traced, surfaces } = contents;
    this.followScreen();
    surfaces.dressAll();
    const start_ms = performance.now();
    const pace = { resolution: 1, isMoving: false, passes: 1, isSmooth: true };
    for (let frames = begun?.frames ?? 0; ; ) {
      const gathers = frames > 0 && !traced.isShown;
      this.draw({ ...pace, gathers });
      frames++;
      const { samples } = traced.status();
      const isDone = traced.isShown
        ? samples >= TRACED_SAMPLES
        : state.quality !== "auto" || !this.picture.canGather || frames >= MAX_SAMPLES;
      // a pixel that is read waits for the drawing, which `finish` does not where another process draws
      this.gl.readPixels(0, 0, 1, 1, this.gl.RGBA, this.gl.UNSIGNED_BYTE, this.pixel);
      if (isDone || performance.now() - start_ms > most_ms) {
        return { frames, isDone, samples: traced.isShown ? Math.floor(samples) : null };
      }
    }
  }

  private poseMono(dt_s: number): Camera {
    const { navigation, contents, state } = this.options.shown();
    const outline = contents.outline(state);
    if (outline !== null) navigation.surround(outline);
    const shown = contents.shownPoints(state);
    if (shown !== null) this.options.room.standUnder(navigation.inRoom(shown));
    navigation.update(dt_s);
    this.followScreen();
    return navigation.camera;
  }

  private followScreen(): void {
    const { stereo, navigation } = this.options.shown();
    const { camera, controls } = navigation;
    stereo.followScreen(this.picture.eyes, camera, controls.target);
  }

  /** Follow the gaze, and go on with what moves and with what fades; whether it goes on. */
  private advance(
    dt_s: number,
    fade_s = dt_s,
  ): Readonly<{ isChanging: boolean; isFading: boolean }> {
    const { head } = this;
    const { hybrid, room, stage, onFollow } = this.options;
    const { contents, stereo, navigation, state } = this.options.shown();
    const { specimen } = room;
    const { group } = specimen;
    const isMoving = specimen.advance(dt_s);
    this.picture.fade.advance(fade_s);
    if (specimen.takeJump() && stereo.kind !== null) this.picture.fade.begin();
    const isReady = (tile: string) => contents.volumes.isReady(tile);
    if (hybrid.look(state, head, group.matrixWorld, isReady, dt_s)) onFollow();
    const screen = {
      camera: navigation.camera,
      height_px: stage.clientHeight,
      focus: navigation.controls.target,
    };
    const seen = {
      head,
      specimen: group.matrixWorld,
      screen: stereo.kind === null ? screen : null,
      gaze: rayAhead(head, group),
      disc: { apex_um: hybrid.apex_um, axis_um: hybrid.axis_um, cosine: hybrid.cosines[1] },
      isPanelOpen: stereo.isPanelOpen,
      isBarBelow: !stereo.isInUsersRoom,
      dt_s,
    };
    const isFading = contents.advance(seen, fade_s);
    const isChanging = isMoving || hybrid.isChanging(state);
    if (isChanging) this.isStale = true;
    if (isFading) this.hasCome = true;
    return { isChanging, isFading };
  }

  private draw(pace: FramePace): void {
    const { picture, head } = this;
    const { contents, stereo, state } = this.options.shown();
    const { volumes, traced, surfaces, marks, slices } = contents;
    const drawn = {
      volumes,
      traced,
      panes: surfaces.blended,
      overlays: [...marks.overlays, ...slices.overlays, ...stereo.overlays],
      bounds: this.options.bounds,
      openTile: this.openTile(state),
      solids: surfaces.triangles + slices.solid,
    };
    const clip = { ...state.clip, corner: slices.cornerTowards(this.eyeOnSpecimen(head)) };
    stereo.present(() => picture.draw(head, drawn, clip, pace));
  }

  private openTile(state: ViewerState): Bounds | null {
    const { room, hybrid } = this.options;
    return room.boundsOf(marchedTile(state, hybrid.focusTiles));
  }

  /** um, world. */
  private eyeOnSpecimen(head: Matrix4): Vec3 {
    const { group } = this.options.room.specimen;
    return group.worldToLocal(this.eye.setFromMatrixPosition(head)).toArray();
  }

  stop(): void {
    this.pulse.stop();
  }

  dispose(): void {
    this.picture.dispose();
    this.pace.dispose();
  }
}

/** Steps of the march that stands in for paths of light; null: as many as the frame's budget allows. */
function stepsOf({ mode, trace: { steps } }: ViewerState): number | null {
  return isTraced({ mode }) && steps > 0 ? Math.min(REST_STEPS, Math.ceil(steps)) : null;
}
