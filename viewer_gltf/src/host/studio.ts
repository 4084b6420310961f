/** Frames that are drawn apart from the page's own: saved images and videos. */
import type { WebGLRenderer } from "three";
import { ERROR_TARGET_PX } from "./form";
import type { SceneFrame, SceneFrameOptions } from "./scene_frame";
import { type Still, type StillMaker, TRACED_SAMPLES } from "./still";

/** Largest number of frames that are averaged for a saved image of marched volumes. */
const MAX_SAMPLES = 64;
/** Milliseconds between two checks whether everything is loaded. */
const POLL_MS = 20;

export type StudioOptions = Readonly<{
  renderer: WebGLRenderer;
  scene: SceneFrame;
  shown: SceneFrameOptions["shown"];
  /** Called when the overview is loaded, so that volumes may be shown. */
  onOverview: () => void;
  /** Stops and starts the page's own frames. */
  stop: () => void;
  start: () => void;
}>;

export class Studio implements StillMaker {
  private readonly pixel = new Uint8Array(4);

  constructor(private readonly options: StudioOptions) {}

  /** Runs a job, which draws with `drawStill`, while the page's own frames are stopped. */
  async apart<T>(job: () => Promise<T>): Promise<T> {
    this.options.stop();
    try {
      return await job();
    } finally {
      this.options.start();
    }
  }

  /** Moves the flat camera, and waits until its view is loaded, for at most `most_ms`. */
  async arrive(dt_s: number, most_ms: number): Promise<void> {
    const start_ms = performance.now();
    this.sync(dt_s);
    while (this.isLoading && performance.now() - start_ms < most_ms) {
      await new Promise((resolve) => setTimeout(resolve, POLL_MS));
      this.sync(0);
    }
  }

  private get isLoading(): boolean {
    return this.options.shown().parts.isLoading;
  }

  /** Moves the flat camera, and streams its view without drawing. */
  private sync(dt_s: number): void {
    const { scene, renderer, shown, onOverview } = this.options;
    const camera = scene.poseMono(dt_s);
    scene.advance(dt_s);
    const { width, height } = renderer.domElement;
    const { forms } = shown();
    if (forms.hasJustBegun()) onOverview();
    forms.stream({ camera, width_px: width, height_px: height, error_px: ERROR_TARGET_PX });
  }

  /**
   * Draws the view of the flat camera, and gathers samples for at most `most_ms`. The qualities Low
   * and High take a single frame.
   *
   * @param begun earlier result of the same view, to continue
   */
  drawStill(most_ms: number, begun: Still | null = null): Still {
    const { scene, renderer, shown } = this.options;
    const { forms, state } = shown();
    const traced = forms.traced?.isShown ? forms.traced : null;
    const gl = renderer.getContext();
    scene.followScreen();
    forms.updateMaterials();
    const start_ms = performance.now();
    const pace = { resolution: 1, isMoving: false, passes: 1, isSmooth: true };
    for (let frames = begun?.frames ?? 0; ; ) {
      const gathers = frames > 0 && traced === null;
      scene.draw({ ...pace, gathers });
      frames++;
      const samples = traced?.status().samples ?? null;
      const isDone =
        samples !== null
          ? samples >= TRACED_SAMPLES
          : state.quality !== "auto" || !scene.picture.canGather || frames >= MAX_SAMPLES;
      // reading a pixel waits for the drawing; `finish` does not if another process draws
      gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, this.pixel);
      if (isDone || performance.now() - start_ms > most_ms) {
        return { frames, isDone, samples: samples === null ? null : Math.floor(samples) };
      }
    }
  }
}
