/**
 * `window.stereocell`: the values that automation may read. Nothing in it changes the viewer. A
 * script operates the page like a user, through its controls (`[data-channel="<id>"]
 * [data-part="shown"]`, `color`, `volume`, `transfer-function`; `[data-mode]`,
 * `[data-tile-choice]`, `[data-action]`).
 *
 * ```ts
 * import "./automation_api";
 *
 * const viewer = window.stereocell;
 * if (viewer === undefined) throw new Error("this page shows no viewer");
 * await viewer.ready;
 * document.querySelector<HTMLElement>('[data-mode="disc"]')?.click();
 * await viewer.settled();
 * const { triangles, volumes } = viewer.snapshot();
 * ```
 */

import type { Snapshot } from "../host/snapshot";

export interface StereoCellApi {
  readonly apiVersion: 1;
  /** Resolves when the overview is on screen; rejects with the message of a fatal error. */
  readonly ready: Promise<void>;
  /**
   * Number of frames drawn so far. An unchanged view draws no frames, except those that make
   * volumes clearer (`quality` auto).
   */
  readonly frames: number;
  /** Resolves when nothing is loading and the view shows everything. */
  settled(): Promise<void>;
  snapshot(): Snapshot;
  /** Report of the benchmark (`?bench`), as bench/report.ts defines it; null: the benchmark has not run. */
  readonly bench: object | null;
}

declare global {
  interface Window {
    stereocell?: StereoCellApi;
  }
}
