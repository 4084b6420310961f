/**
 * Services that a part offers to the others, by name. A part asks the host for a service, and gets
 * null if no part offers it. Every part can therefore be removed from the viewer.
 */
import type { Object3D } from "three";
import type { HandleId } from "../marks/clip_handles";
import type { Vec3 } from "../math/vec3";
import type { Refusal, Request } from "../panel/controls";
import type { BlendedSurface } from "../render/blend_material";
import type { Action } from "../state/actions";
import type { CameraView } from "../state/camera_view";
import type { ObjectView } from "../state/objects";
import type { ShownSurface } from "../state/on_screen";
import type { XrSupport } from "../state/stereo";
import type { ViewerState } from "../state/viewer_state";
import type { BrickService } from "../voxels/bricks/brick_service";
import type { Appearance } from "../voxels/march_tables";
import type { VolumeLimits } from "../voxels/mip_levels";
import type { VolumeSource } from "../voxels/volume_source";

/**
 * A legend of colours. `column` is the name of the table column that sets the colours. A row has
 * one colour, the colours of a palette from end to end, or none for a text alone.
 */
export type ColorLegend = Readonly<{
  column: string;
  rows: readonly Readonly<{ colors: readonly string[]; text: string }>[];
}>;

/** The objects of the shown label maps. */
export interface ObjectMaps {
  /**
   * Returns the legend of a channel's objects; null: they have the stage's colours, or are not
   * loaded yet.
   */
  legend(channel: string): ColorLegend | null;
  /** Some colours of the objects, by channel. */
  readonly colors: ReadonlyMap<string, readonly string[]>;
  /**
   * Returns the text of a link for a channel's objects, and the number of objects that it omits;
   * null: not loaded yet.
   */
  linked(channel: string, view: ObjectView): Readonly<{ text: string; leftOut: number }> | null;
  /**
   * For each channel, the numbers of its objects' rows in the table; only objects that are shown.
   */
  readonly rowsShown: ReadonlyMap<string, readonly number[]>;
  /** Returns the number of a channel's objects that are shown; null: their table is not loaded yet. */
  shownCount(channel: string): number | null;
}

/** Makes images of the view. */
export interface PosterMaker {
  /**
   * Makes an image of the screen, with a longest edge of at most `longest_px` pixels. Rejects with
   * a DOMException.
   */
  poster(longest_px: number): Promise<Blob>;
}

/** The handles of cuts and lamps in the scene. */
export interface HandleLights {
  /** Highlights a handle; null: none. */
  highlight(handle: HandleId | null): void;
}

/** The points of the measurement. */
export interface MeasuredPoints {
  /** For each measured point, the values of the shown channels that are loaded, for example `DAPI 1210`. */
  readonly values: readonly (readonly string[])[];
}

/** The panel in the page. */
export interface PagePanel {
  /** Carries out a request of the panel or of a card. */
  perform(request: Request | Refusal): void;
  /** Focuses a control, also in a hidden panel. Returns whether it exists. */
  focus(section: string, control: string): boolean;
  /** Shows an announcement on the page, and not in stereo. */
  showAnnouncement(words: string): void;
  /** Adds a button to the last announcement. */
  offer(words: string, label: string, act: () => void): void;
}

/** Finds the button that removes the cause of a refusal. */
export interface MessageButtons {
  /** Returns the button of a refusal; null: it has none. */
  buttonFor(refusal: string): Promise<Readonly<{ label: string; act: () => void }> | null>;
}

/** The volumes of the channels. */
export interface Volumes {
  /** Returns the source of a channel's volume in a tile; null: not known yet, or none. */
  source(tile: string, channel: string): VolumeSource | null;
  /** Resolves to the source once it is known; null: none, or a fault that was reported. */
  sourceOf(tile: string, channel: string): Promise<VolumeSource | null>;
  /** Resolves to all volumes of a channel, by tile; null: a fault that was reported. */
  sourcesOf(channel: string): Promise<ReadonlyMap<string, VolumeSource> | null>;
  /** Returns the outermost points (um, world) of a channel's volumes; null: not all are loaded. */
  outline(channel: string): readonly Vec3[] | null;
  /** Returns how far the volume of a channel in a tile has faded in, 0..1. */
  presence(tile: string, channel: string): number;
  /** Whether all marched volumes are shown only in the focus disc. */
  readonly isInDisc: boolean;
  readonly appearances: Readonly<{ of: (state: ViewerState, channel: string) => Appearance }>;
}

/** Limits of the textures of volumes, and the source of their voxels. */
export type VolumeTexels = Readonly<{
  limits: VolumeLimits;
  /** The service of a host that sends bricks by view; null: volumes are files. */
  bricks: BrickService | null;
}>;

export type LoadedSurface = Readonly<{ scene: Object3D; tile: string; blend: BlendedSurface }>;

/** The surfaces of the channels. */
export interface Surfaces {
  /** The meshes on screen. */
  readonly meshes: readonly ShownSurface[];
  /** Returns all loaded surfaces of a channel. */
  of(channel: string): readonly LoadedSurface[];
  /** Adds a listener for surfaces that have been loaded. */
  onLoaded(listener: (channel: string, surface: LoadedSurface) => void): void;
  /** Returns the outermost points (um, world) of a channel's surfaces; null: not known yet. */
  outline(channel: string): readonly Vec3[] | null;
}

/** The kinds of stereo that the browser and the device offer. */
export interface StereoFinder {
  readonly found: Promise<Readonly<{ stereo: XrSupport; hasRoom: boolean }>>;
}

/** Reads and writes links to the view, for a part that shares the view in another way. */
export type LinkCode = Readonly<{
  /** Returns the link to the present view. */
  link: () => string;
  /** Returns the actions and the camera of a link; null: the opening camera. */
  read: (
    link: string,
    state: ViewerState,
  ) => Readonly<{ actions: readonly Action[]; camera: CameraView | null }>;
}>;
export interface Links {
  /** Loads the code that writes and reads links. */
  load(): Promise<LinkCode>;
  /** Writes the present view to the page's address at once, for example before a reload. */
  writeAddress(): void;
}

/** The result of the benchmark. */
export interface BenchResult {
  /** The report of the benchmark; null: it has not run. */
  readonly report: object | null;
}

export type Services = Readonly<{
  stereoSupport: StereoFinder;
  links: Links;
  bench: BenchResult;
  volumes: Volumes;
  texels: VolumeTexels;
  surfaces: Surfaces;
  objects: ObjectMaps;
  posters: PosterMaker;
  handles: HandleLights;
  measured: MeasuredPoints;
  messages: MessageButtons;
  page: PagePanel;
}>;
