/** The viewer in numbers: for automation, the panel and the benchmark. */
import type { WebGLRenderer } from "three";
import type { CameraPose } from "../interaction/named_views";
import type { VolumeStatus } from "../render/drawn_forms";
import type { GazeFocus } from "../render/gaze_focus";
import type { Room } from "../render/scene";
import { discLimit } from "../state/focus_tiles";
import type { Progress } from "../state/overview_progress";
import type { QualitySettings } from "../state/quality_controller";
import type { ViewerState } from "../state/viewer_state";
import type { MenuEntry } from "../xr/panel/menu_entries";
import type { Stereo } from "../xr/stereo";
import type { Forms } from "./forms";
import type { Viewpoint } from "./viewpoint";

export type Snapshot = Readonly<{
  state: ViewerState;
  /** From where the flat camera sees the specimen, m of the room. */
  look: CameraPose;
  /** Whether all tiles show, in the first channel. */
  hasFirstPicture: boolean;
  /** The progress of the overviews of all shown channels. */
  overview: Progress;
  isLoading: boolean;
  /** Triangles of the surfaces on screen. */
  triangles: number;
  /** Of the last frame, both eyes and all passes. */
  drawCalls: number;
  volumes: readonly VolumeStatus[];
  /** Of the GPU's memory. */
  volumeBytes: number;
  /** The path-traced picture's samples of a pixel and its mip level; null: there is no such picture. */
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
  /** For each measured point the value of each shown channel there. */
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

export type SnapshotSource = Readonly<{
  state: ViewerState;
  renderer: WebGLRenderer;
  room: Room;
  hybrid: GazeFocus;
  forms: Forms;
  stereo: Stereo;
  viewpoint: Viewpoint;
  loop: Readonly<{ frame_ms: number; settings: QualitySettings }>;
  isLoading: boolean;
  measuredValues: Snapshot["measuredValues"];
}>;

export function snapshotOf(source: SnapshotSource): Snapshot {
  const { state, renderer, room, hybrid, forms, stereo, viewpoint, loop } = source;
  const { marched, traced } = forms;
  const { memory, render, programs } = renderer.info;
  return {
    state,
    look: viewpoint.navigation.cameraPose,
    hasFirstPicture: forms.hasFirst,
    overview: forms.overview,
    isLoading: source.isLoading,
    triangles: forms.triangles,
    drawCalls: render.calls,
    volumes: marched?.status() ?? [],
    volumeBytes: marched?.bytes ?? 0,
    traced: traced?.status() ?? { samples: 0, level: null },
    gazed: hybrid.focusTiles.focusTile,
    discRadius_deg: (hybrid.outer_rad * 180) / Math.PI,
    discLimit_deg: discLimit(hybrid.focusTiles, state.discRadius_deg),
    frame_ms: loop.frame_ms,
    settings: loop.settings,
    measuredValues: source.measuredValues,
    gpuObjects: { ...memory, programs: programs?.length ?? 0 },
    isStereo: stereo.kind !== null,
    specimenAt: room.specimen.middle,
    specimenTurn: room.specimen.pose.orientation.toArray(),
    told: stereo.notices,
    menu: stereo.menu,
  };
}
