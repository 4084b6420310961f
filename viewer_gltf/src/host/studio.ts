/** Frames that are drawn apart from the page's own: pictures that are saved, and videos. */
import type { WebGLRenderer } from "three";
import { ERROR_TARGET_PX } from "./form";
import type { SceneFrame, SceneFrameOptions } from "./scene_frame";
import { type Still, type StillMaker, TRACED_SAMPLES } from "./still";

/** Most frames of a picture that is saved that are averaged, where it is marched. */
const MAX_SAMPLES = 64;
/** Time between two checks whether everything has loaded, ms. */
const POLL_MS = 20;

export type StudioOptions = Readonly<{
  renderer: WebGLRenderer;
  scene: SceneFrame;
  shown: SceneFrameOptions["shown"];
  /** The overview has loaded, so volumes may be shown. */
  onOverview: () => void;
  /** Stops the page's own frames, and starts them again. */
  stop: () => void;
  start: () => void;
}>;

export class Studio implements StillMaker {
  private readonly pixel = new Uint8Array(4);

  constructor(private readonly options: StudioOptions) {}

  /** Keeps the page's own frames from drawing while a job draws by `drawStill`. */
  async apart<T>(job: () => Promise<T>): Promise<T> {
    this.options.stop();
    try {
      return await job();
    } finally {
      this.options.start();
    }
  }

  /** Follows the flat camera until what it sees has come, for so long at most. */
  async arrive(dt_s: number, most_ms: number): Promise<void> {
    const start_ms = performance.now();
    this.follow(dt_s);
    while (this.isLoading && performance.now() - start_ms < most_ms) {
      await new Promise((resolve) => setTimeout(resolve, POLL_MS));
      this.follow(0);
    }
  }

  private get isLoading(): boolean {
    return this.options.shown().parts.isLoading;
  }

  /** Follows the flat camera, without drawing. */
  private follow(dt_s: number): void {
    const { scene, renderer, shown, onOverview } = this.options;
    const camera = scene.poseMono(dt_s);
    scene.advance(dt_s);
    const { width, height } = renderer.domElement;
    const { forms } = shown();
    if (forms.hasJustBegun()) onOverview();
    forms.stream({ camera, width_px: width, height_px: height, error_px: ERROR_TARGET_PX });
  }

  /**
   * Draws the flat camera's view at once: samples are gathered for so long, but for the quality Low or High.
   *
   * @param begun the earlier result for the same view, to go on with
   */
  drawStill(most_ms: number, begun: Still | null = null): Still {
    const { scene, renderer, shown } = this.options;
    const { forms, state } = shown();
    const traced = forms.traced?.isShown ? forms.traced : null;
    const gl = renderer.getContext();
    scene.followScreen();
    forms.dress();
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
      // a pixel that is read waits for the drawing, which `finish` does not where another process draws
      gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, this.pixel);
      if (isDone || performance.now() - start_ms > most_ms) {
        return { frames, isDone, samples: samples === null ? null : Math.floor(samples) };
      }
    }
  }
}
