/**
 * `window.stereocell`: what automation may read. Nothing in it changes the viewer; a script drives
 * the page as a person does, through its controls (`[data-channel="<id>"] [data-part="shown"]`,
 * `color`, `volume`, `transfer-function`; `[data-scope]`, `[data-tile-choice]`, `[data-action]`).
 */
import type { Progress } from "./mesh/progress";
import type { ViewerState } from "./state";
import type { VolumeStatus } from "./volume/volume_set";

export type Snapshot = Readonly<{
  state: ViewerState;
  overview: Progress;
  isLoading: boolean;
  /** Triangles of the surfaces on screen. */
  triangles: number;
  volumes: readonly VolumeStatus[];
  isStereo: boolean;
}>;

export interface StereoCellApi {
  readonly apiVersion: 1;
  /** Resolves when the overview is on screen; rejects with the words of a fatal error. */
  readonly ready: Promise<void>;
  /** Frames drawn so far. A still picture draws none. */
  readonly frames: number;
  /** Resolves when nothing is loading any more and the picture shows all of it. */
  settled(): Promise<void>;
  snapshot(): Snapshot;
}

declare global {
  interface Window {
    stereocell?: StereoCellApi;
  }
}
