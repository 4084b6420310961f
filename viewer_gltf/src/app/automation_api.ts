/**
 * `window.stereocell`: what automation may read. Nothing in it changes the viewer; a script drives
 * the page as a person does, through its controls (`[data-channel="<id>"] [data-part="shown"]`,
 * `color`, `volume`, `transfer-function`; `[data-mode]`, `[data-tile-choice]`, `[data-action]`).
 */

import type { Snapshot } from "../host/snapshot";

export interface StereoCellApi {
  readonly apiVersion: 1;
  /** Resolves when the overview is on screen; rejects with the words of a fatal error. */
  readonly ready: Promise<void>;
  /** Frames drawn so far. A still picture draws none, but for those by which volumes clear up (`quality` auto). */
  readonly frames: number;
  /** Resolves when nothing is loading any more and the picture shows all of it. */
  settled(): Promise<void>;
  snapshot(): Snapshot;
  /** The report of the benchmark (`?bench`), as bench/report.ts defines it; null: the benchmark has not run. */
  readonly bench: object | null;
}

declare global {
  interface Window {
    stereocell?: StereoCellApi;
  }
}
