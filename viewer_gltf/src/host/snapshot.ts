/** The viewer in numbers, for automation, the panel and the benchmark. */
import type { WebGLRenderer } from "three";
import type { CameraPose } from "../interaction/named_views";
import type { VolumeStatus } from "../render/drawn_forms";
import type { GazeFocus } from "../render/gaze_focus";
import type { SpecimenScene } from "../render/specimen_scene";
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
  /** Pose of the flat camera, in metres of the scene. */
  look: CameraPose;
  /** Whether all tiles of the first shown channel are on screen. */
  hasFirstPicture: boolean;
  /** Loading progress of the overviews of all shown channels. */
  overview: Progress;
  isLoading: boolean;
  /** Triangles of the surfaces on screen. */
  triangles: number;
  /** Draw calls of the last frame, for both eyes and all passes. */
  drawCalls: number;
  volumes: readonly VolumeStatus[];
  /** Bytes of the volumes in GPU memory. */
  volumeBytes: number;
  /** Samples per pixel and mip level of the path-traced image; level null: path tracing is off. */
  traced: Readonly<{ samples: number; level: number | null }>;
  /** The tile in the middle of the view, if it is near. */
  gazed: string | null;
  /** Present radius of the focus disc, degrees; 0: closed. */
  discRadius_deg: number;
  /** Radius at which the limit of tiles ends the focus disc, degrees; null: it covers fewer tiles. */
  discLimit_deg: number | null;
  /** Time between two frames of a motion, ms. */
  frame_ms: number;
  /** Settings of the last frame. */
  settings: QualitySettings;
  /** For each measured point, the value of each shown channel. */
  measuredValues: readonly (readonly string[])[];
  /** Objects on the GPU, as three.js counts them. */
  gpuObjects: Readonly<{ geometries: number; textures: number; programs: number }>;
  isStereo: boolean;
  /** Place of the specimen's middle, in metres of the scene. */
  specimenAt: readonly [number, number, number];
  /** Rotation of the specimen in the scene, a quaternion. */
  specimenTurn: readonly [number, number, number, number];
  /** Notices that are visible in stereo now. */
  stereoNotices: readonly string[];
  /** Controls of the panel in the scene now, its button first; none on a flat screen. */
  menu: readonly MenuEntry[];
}>;

export type SnapshotSource = Readonly<{
  state: ViewerState;
  renderer: WebGLRenderer;
  specimenScene: SpecimenScene;
  hybrid: GazeFocus;
  forms: Forms;
  stereo: Stereo;
  viewpoint: Viewpoint;
  loop: Readonly<{ frame_ms: number; settings: QualitySettings }>;
  isLoading: boolean;
  measuredValues: Snapshot["measuredValues"];
}>;

export function snapshotOf(source: SnapshotSource): Snapshot {
  const { state, renderer, specimenScene, hybrid, forms, stereo, viewpoint, loop } = source;
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
    specimenAt: specimenScene.specimen.middle,
    specimenTurn: specimenScene.specimen.pose.orientation.toArray(),
    stereoNotices: stereo.notices,
    menu: stereo.menu,
  };
}
