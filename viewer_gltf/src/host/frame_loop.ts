/** Draws frames, only when something has changed, each as well as its budget allows. */
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

/** Longest time that a frame counts, s: nobody looked at a page that slept. */
const LONGEST_FRAME_S = 0.1;
/**
 * The same for fades and notices, after a frame that was drawn and took as long: on a slow device, too, they end
 * when they shall.
 */
const LONGEST_FADE_S = 1;
/** Pixels of the volumes, as a share of the picture's along an edge: with fewer they are blocks. */
const MIN_TURNING = 0.5;

export type FrameOptions = SceneFrameOptions &
  Readonly<{
    /** The overview has loaded, so volumes may be shown. */
    onOverview: () => void;
    /** Called after every frame drawn. */
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
  /** Whether what is looked at, or from where, has changed since the last frame. */
  private isStale = true;
  /** Whether something has come for the picture since the last frame, which may be at rest. */
  private hasCome = false;
  /** Whether the frame before was one of a moving picture, drawn in its budget. */
  private wasMoving = false;
  /** Whether the last turn of the page drew a frame. */
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

  /** The view or the specimen in it has changed: the picture has to follow at once. */
  redraw(): void {
    this.isStale = true;
    this.pulse.wake();
  }

  /** Something has come for the picture, which may be at rest. */
  requestFrame(): void {
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

  /** Whether the picture moves now, and its frames are late. */
  get isLate(): boolean {
    return this.pace.isLate;
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
    this.pace = new FrameBudget(this.gl);
  }

  private get isLoading(): boolean {
    return this.options.shown().parts.isLoading;
  }

  /** Draws a frame if one is due. Returns whether nothing more is to be drawn until something changes. */
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
    const isDue = this.resting.isDue(time_ms) && this.hasCome;
    const isMoving = isStereo || this.isStale;
    // a picture that came to rest is drawn once more, as well as can be
    const isWanted = isMoving || this.wasMoving || isGathering || isDue;
    // "High" and "low" are alike in all frames
    const canGather = this.options.shown().state.quality === "auto" && picture.canGather;
    const gathers = !isWanted && canGather && this.resting.isDue(time_ms);
    // someone waits: what is missing is looked for, and a picture that shows all is not drawn again
    const isAwaited = this.waiting.length > 0;
    if (!isWanted && !gathers && !wasLoading && !this.hasCome && !isAwaited) {
      return !canGather && !forms.isGathering;
    }
    const settings = this.begin(isMoving, interval_ms);
    this.stream(camera, settings);
    if (isWanted || gathers) {
      this.isStale = isChanging;
      this.hasCome = isFading;
      forms.dress();
      const { passes } = this.gathering;
      // late frames give up smooth edges first
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
    const isAtRest = isStereo || (!isMoving && !this.hasCome);
    if (isAwaited && !this.isLoading && !this.isStale && isAtRest) {
      for (const resolve of this.waiting.splice(0)) resolve();
    }
    return false;
  }

  /** Poses the eyes, and goes on with what moves and with what fades. */
  private advance(passed_s: number) {
    const { onOverview } = this.options;
    const { forms, stereo, viewpoint } = this.options.shown();
    const { picture } = this.scene;
    const dt_s = Math.min(LONGEST_FRAME_S, passed_s);
    const fade_s = Math.min(this.hasDrawn ? LONGEST_FADE_S : LONGEST_FRAME_S, passed_s);
    this.hasDrawn = false;
    if (forms.hasJustBegun()) onOverview();
    const inRoom = stereo.pose(picture.eyes);
    picture.isSeeThrough = stereo.isInUsersRoom;
    const camera = inRoom ?? this.scene.poseMono(passed_s);
    if (inRoom !== null) {
      stereo.update(dt_s, viewpoint.head, this.options.shown().state, fade_s);
    }
    const { isChanging, isFading } = this.scene.advance(dt_s, fade_s);
    if (isChanging) this.isStale = true;
    if (isFading) this.hasCome = true;
    return { camera, isStereo: inRoom !== null, isChanging, isFading };
  }

  /** Begins a frame within its budget. */
  private begin(isMoving: boolean, interval_ms: number): QualitySettings {
    const { stereo, viewpoint, state } = this.options.shown();
    const settings = this.pace.begin(isMoving, interval_ms, stereo.headset.rate_hz);
    // too slow a device to turn the specimen by itself shows it at rest, as well as can be
    if (settings.resolution < MIN_TURNING) viewpoint.navigation.stopTurning();
    this.scene.picture.marchFrame.uSteps.value = stepsOf(state) ?? settings.steps;
    this.options.hybrid.radiusShare = settings.discShare;
    return settings;
  }

  private stream(camera: Camera, { errorFactor }: QualitySettings): void {
    const [eye] = this.scene.picture.eyes.all; // a headset has none before its first pose
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

/** Steps of the march that stands in for paths of light; null: as many as the frame's budget allows. */
function stepsOf({ mode, trace: { steps } }: ViewerState): number | null {
  return isTraced({ mode }) && steps > 0 ? Math.min(REST_STEPS, Math.ceil(steps)) : null;
}
