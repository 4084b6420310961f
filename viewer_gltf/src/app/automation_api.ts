/**
 * `window.stereocell`: what automation may read. Nothing in it changes the viewer; a script drives
 * the page as a person does, through its controls (`[data-channel="<id>"] [data-part="shown"]`,
 * `color`, `volume`, `transfer-function`; `[data-mode]`, `[data-tile-choice]`, `[data-action]`).
 */

import type { Report } from "../bench/report";
import type { Look } from "../interaction/orbit_camera";
import type { QualitySettings } from "../state/quality_controller";
import type { ViewerState } from "../state/viewer_state";
import type { Progress } from "../surfaces/overview_progress";
import type { VolumeStatus } from "../volumes/volume_set";
import type { MenuEntry } from "../xr/panel/menu_entries";

export type Snapshot = Readonly<{
  state: ViewerState;
  /** From where the flat camera sees the specimen, m of the room. */
  look: Look;
  /** Whether all tiles show, in the first channel. */
  hasFirstPicture: boolean;
  /** Of all shown channels. */
  overview: Progress;
  isLoading: boolean;
  /** Triangles of the surfaces on screen. */
  triangles: number;
  /** Of the last frame, both eyes and all passes. */
  drawCalls: number;
  volumes: readonly VolumeStatus[];
  /** Of the GPU's memory. */
  volumeBytes: number;
  /** Of the path-traced picture: samples a pixel, and the mip level; null: there is none. */
  traced: Readonly<{ samples: number; level: number | null }>;
  /** The tile in the middle of the view, if it is near. */
  gazed: string | null;
  /** Of the disc as it is now; 0: closed. */
  discRadius_deg: number;
  /** Where the limit of tiles in the disc ends it; null: it covers no more. */
  discLimit_deg: number | null;
  /** Between two frames of a moving picture. */
  frame_ms: number;
  /** The settings of the last frame. */
  settings: QualitySettings;
  /** Of each measured point: each shown channel's value there. */
  measuredValues: readonly (readonly string[])[];
  /** Of three's own count. */
  gpuObjects: Readonly<{ geometries: number; textures: number; programs: number }>;
  isStereo: boolean;
  /** The specimen's middle in the room, m. */
  specimenAt: readonly [number, number, number];
  /** Its turn there: a quaternion. */
  specimenTurn: readonly [number, number, number, number];
  /** The notices before the eyes now, in stereo. */
  told: readonly string[];
  /** The controls of the panel in the room now, its button first; none on a flat screen. */
  menu: readonly MenuEntry[];
}>;

export interface StereoCellApi {
  readonly apiVersion: 1;
  /** Resolves when the overview is on screen; rejects with the words of a fatal error. */
  readonly ready: Promise<void>;
  /** Frames drawn so far. A still picture draws none, but for those by which volumes clear up (`quality` auto). */
  readonly frames: number;
  /** Resolves when nothing is loading any more and the picture shows all of it. */
  settled(): Promise<void>;
  snapshot(): Snapshot;
  /** What the benchmark (`?bench`) has found; null: it has not been run. */
  bench: Report | null;
}

declare global {
  interface Window {
    stereocell?: StereoCellApi;
  }
}
