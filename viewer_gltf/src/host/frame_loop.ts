/** Draws frames only when something has changed, each as fine as its time budget allows. */
import type { Camera } from "three";
import { FrameBudget } from "../render/pacing/frame_budget";
import { RedrawAtRest } from "../render/pacing/redraw_at_rest";
import { SamplesPerFrame } from "../render/pacing/samples_per_frame";
import { isTraced } from "../state/parameters/volumes";
import type { QualityLevel, QualitySettings } from "../state/quality_controller";
import type { ViewerState } from "../state/viewer_state";
import { MAX_STEPS, REST_STEPS } from "../voxels/march_frame";
import { ERROR_TARGET_PX } from "./form";
import { Pulse } from "./pulse";
import { SceneFrame, type SceneFrameOptions } from "./scene_frame";
import { Studio } from "./studio";

/** Largest time step of a frame, s. After a pause, such as a hidden tab, motions go on from where they stopped. */
const LONGEST_FRAME_S = 0.1;
/**
 * Largest time step of fades and notices, s, if a frame really took that long to draw. Fades and
 * notices then end on time on a slow device, too.
 */
const LONGEST_FADE_S = 1;
/**
 * Smallest ratio, along an edge, of marched pixels to the frame's pixels at which the specimen may
 * turn by itself. Volumes with fewer pixels look like blocks.
 */
const MIN_TURNING = 0.5;

export type FrameOptions = SceneFrameOptions &
  Readonly<{
    /** Called when the overview is loaded, so that volumes may be shown. */
    onOverview: () => void;
    /** Called after every frame. */
    onFrame: () => void;
  }>;

export class FrameLoop {
  readonly scene: SceneFrame;
  readonly studio: Studio;
  private readonly pulse: Pulse;
  /** Frames drawn so far. */
  frames = 0;
  private readonly gl: WebGL2RenderingContext;
  private pace: FrameBudget;
  private readonly gathering: SamplesPerFrame;
  private readonly resting: RedrawAtRest;
  private last_ms = 0;
  /** Whether the scene or the camera has changed since the last frame. */
  private isStale = true;
  /** Whether something has been loaded since the last frame, which an unchanged view has to show. */
  private hasNews = false;
  /** Whether the previous frame was part of a motion, so that it was drawn within a budget. */
  private wasMoving = false;
  /** Whether the last call of `frame` drew anything. Frames are skipped while nothing changes. */
  private hasDrawn = false;
  private waiting: (() => void)[] = [];
  private drawn: (() => void)[] = [];

  constructor(private readonly options: FrameOptions) {
    const { renderer, shown, onOverview } = options;
    this.gl = renderer.getContext() as WebGL2RenderingContext;
    this.pulse = new Pulse(renderer, (time_ms) => this.frame(time_ms));
    this.scene = new SceneFrame(options);
    this.studio = new Studio({
      ...{ renderer, scene: this.scene, shown, onOverview },
      stop: () => this.stop(),
      start: () => {
        this.start();
        this.redraw();
      },
    });
    this.pace = new FrameBudget(this.gl);
    this.gathering = new SamplesPerFrame(this.gl);
    this.resting = new RedrawAtRest(this.gl);
  }

  start(): void {
    this.pulse.start();
  }

  stop(): void {
    this.pulse.stop();
  }

  /** Draws again at once, because the view or the specimen has changed. */
  redraw(): void {
    this.isStale = true;
    this.pulse.wake();
  }

  /** Draws again soon, because something was loaded; the view may be unchanged. */
  requestFrame(): void {
    this.hasNews = true;
    this.pulse.wake();
  }

  setLevel(level: QualityLevel): void {
    this.pace.setLevel(level);
  }

  /** Smoothed time between two frames of a motion, ms. */
  get frame_ms(): number {
    return this.pace.frame_ms;
  }

  /** Whether the view is moving now, and its frames are late. */
  get isLate(): boolean {
    return this.pace.isLate;
  }

  /** Settings of the last frame. */
  get settings(): QualitySettings {
    return this.pace.settings;
  }

  /** Resolves when nothing is loading and the view shows everything. */
  settled(): Promise<void> {
    this.pulse.wake();
    return new Promise((resolve) => this.waiting.push(resolve));
  }

  /** Resolves when the next frame has been drawn. */
  nextFrame(): Promise<void> {
    return new Promise((resolve) => this.drawn.push(resolve));
  }

  /** Drops the GPU timers after the graphics context was lost. */
  forget(): void {
    this.gathering.forget();
    this.resting.forget();
  }

  /** Makes new GPU timers after the graphics context was restored. */
  renew(): void {
    this.pace = new FrameBudget(this.gl);
  }

  private get isLoading(): boolean {
    return this.options.shown().parts.isLoading;
  }

  /** Draws a frame if one is due. Returns whether nothing has to be drawn until something changes. */
  private frame(time_ms: number): boolean {
    const { renderer } = this.options;
    if (renderer.getContext().isContextLost()) return true; // there is nothing to draw on
    const { forms } = this.options.shown();
    const { picture } = this.scene;
    const interval_ms = time_ms - this.last_ms;
    this.last_ms = time_ms;
    const wasLoading = this.isLoading;
    const passed_s = Math.max(0, interval_ms / 1000);
    const { camera, isStereo, isChanging, isFading } = this.advance(passed_s);
    const isGathering = forms.isGathering && this.gathering.isReady(time_ms);
    const isDue = this.resting.isDue(time_ms) && this.hasNews;
    const isMoving = isStereo || this.isStale;
    // after a motion, one more frame is drawn in full quality
    const isWanted = isMoving || this.wasMoving || isGathering || isDue;
    // with the quality "high" or "low", a view at rest is not refined by further frames
    const canGather = this.options.shown().state.quality === "auto" && picture.canGather;
    const gathers = !isWanted && canGather && this.resting.isDue(time_ms);
    // a caller waits for a complete view: missing files are streamed, and a complete view is not
    // drawn again
    const isAwaited = this.waiting.length > 0;
    if (!isWanted && !gathers && !wasLoading && !this.hasNews && !isAwaited) {
      return !canGather && !forms.isGathering;
    }
    const settings = this.begin(isMoving, interval_ms);
    this.stream(camera, settings);
    if (isWanted || gathers) {
      this.isStale = isChanging;
      this.hasNews = isFading;
      forms.updateMaterials();
      const { passes } = this.gathering;
      // a moving view has smooth edges only while the number of steps is not reduced
      const isSmooth = !isMoving || settings.steps >= MAX_STEPS;
      this.scene.draw({ resolution: settings.resolution, isMoving, passes, isSmooth, gathers });
      if (isGathering) this.gathering.submit(time_ms);
      if (!isMoving) this.resting.submit(time_ms);
      this.frames++;
      this.hasDrawn = true;
      this.options.onFrame();
      for (const resolve of this.drawn.splice(0)) resolve();
    }
    this.pace.end();
    this.wasMoving = isMoving;
    const isAtRest = isStereo || (!isMoving && !this.hasNews);
    if (isAwaited && !this.isLoading && !this.isStale && isAtRest) {
      for (const resolve of this.waiting.splice(0)) resolve();
    }
    return false;
  }

  /** Poses the eyes, and advances motions and fades. */
  private advance(passed_s: number) {
    const { onOverview } = this.options;
    const { forms, stereo, viewpoint } = this.options.shown();
    const { picture } = this.scene;
    const dt_s = Math.min(LONGEST_FRAME_S, passed_s);
    const fade_s = Math.min(this.hasDrawn ? LONGEST_FADE_S : LONGEST_FRAME_S, passed_s);
    this.hasDrawn = false;
    if (forms.hasJustBegun()) onOverview();
    const stereoCamera = stereo.pose(picture.eyes);
    picture.isSeeThrough = stereo.isInUsersRoom;
    const camera = stereoCamera ?? this.scene.poseMono(passed_s);
    if (stereoCamera !== null) {
      stereo.update(dt_s, viewpoint.head, this.options.shown().state, fade_s);
    }
    const { isChanging, isFading } = this.scene.advance(dt_s, fade_s);
    if (isChanging) this.isStale = true;
    if (isFading) this.hasNews = true;
    return { camera, isStereo: stereoCamera !== null, isChanging, isFading };
  }

  /** Begins a frame within its budget. */
  private begin(isMoving: boolean, interval_ms: number): QualitySettings {
    const { stereo, viewpoint, state } = this.options.shown();
    const settings = this.pace.begin(isMoving, interval_ms, stereo.headset.rate_hz);
    // a device that is too slow to turn the specimen shows it at rest, in full quality
    if (settings.resolution < MIN_TURNING) viewpoint.navigation.stopTurning();
    this.scene.picture.marchFrame.uSteps.value = stepsOf(state) ?? settings.steps;
    this.options.hybrid.radiusShare = settings.discShare;
    return settings;
  }

  private stream(camera: Camera, { errorFactor }: QualitySettings): void {
    const [eye] = this.scene.picture.eyes.all; // a headset has no eyes before its first pose
    if (eye === undefined) return;
    const { forms, stereo } = this.options.shown();
    const { z, w } = eye.viewport;
    const error_px = ERROR_TARGET_PX * errorFactor;
    forms.stream({ camera: stereo.seenBy(camera), width_px: z, height_px: w, error_px });
  }

  dispose(): void {
    this.scene.dispose();
    this.pace.dispose();
  }
}

/**
 * Returns the number of steps per ray of the march that is shown until path tracing has an image.
 * The user sets it; null: as many as the time budget of a frame allows.
 */
function stepsOf({ mode, trace: { steps } }: ViewerState): number | null {
  return isTraced({ mode }) && steps > 0 ? Math.min(REST_STEPS, Math.ceil(steps)) : null;
}
