/** Frames that are drawn apart from the page's own, for saved images. */

/** Samples per pixel of a path-traced image, enough to need no denoising. */
export const TRACED_SAMPLES = 192;

/** Progress of a saved image. */
export type Still = Readonly<{
  frames: number;
  isDone: boolean;
  /** Samples per pixel; null: not path-traced. */
  samples: number | null;
}>;

export interface StillMaker {
  /** Runs a job while the page's own frames are stopped. */
  apart<T>(job: () => Promise<T>): Promise<T>;
  /** Moves the camera by a time step of `dt_s`, and waits until its view is loaded, for at most `most_ms`. */
  arrive(dt_s: number, most_ms: number): Promise<void>;
  /** Draws the view in full quality for at most `most_ms`; `begun`: continues an earlier result. */
  drawStill(most_ms: number, begun?: Still | null): Still;
}
