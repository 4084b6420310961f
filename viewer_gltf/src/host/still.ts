/** Pictures that are drawn apart from the page's own frames. */

/** Samples of each pixel where it is traced: with so many nothing has to be denoised. */
export const TRACED_SAMPLES = 192;

/** How far a picture that is saved has come. */
export type Still = Readonly<{
  frames: number;
  isDone: boolean;
  /** Samples of each pixel, where it is traced; null: it is not. */
  samples: number | null;
}>;

export interface StillMaker {
  /** Keeps the page's own frames from drawing while a job runs. */
  apart<T>(job: () => Promise<T>): Promise<T>;
  /** Follows the camera, as long in seconds as a frame takes, until what it sees has come: so many ms at most. */
  arrive(dt_s: number, most_ms: number): Promise<void>;
  /** Draws the view as well as can be in so many ms; `begun`: goes on with it. */
  drawStill(most_ms: number, begun?: Still | null): Still;
}
