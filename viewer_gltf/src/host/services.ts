/**
 * Services that a part offers to the others, by name. A part that uses one asks the host for it and gets null if no
 * part offers it, so that every part can be left out of the viewer.
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

/** `column`: the name of the one that colours. Of a row, one colour, or a palette's from end to end; none: words alone. */
export type ColorLegend = Readonly<{
  column: string;
  rows: readonly Readonly<{ colors: readonly string[]; text: string }>[];
}>;

/** The objects of the label maps that are shown. */
export interface ObjectMaps {
  /** Returns the legend of a channel's objects; null: they have the stage's colours, or have not come. */
  legend(channel: string): ColorLegend | null;
  /** Some of the objects' colours, by channel. */
  readonly colors: ReadonlyMap<string, readonly string[]>;
  /** Returns a link's text on a channel's objects, and how many it leaves out; null: their table has not come. */
  linked(channel: string, view: ObjectView): Readonly<{ text: string; leftOut: number }> | null;
  /** Rows of the objects that show, by channel. */
  readonly rowsShown: ReadonlyMap<string, readonly number[]>;
  /** How many objects of a channel show; null: their table has not come. */
  left(channel: string): number | null;
}

/** Pictures of the view, for whatever saves them. */
export interface PosterMaker {
  /** Makes an image of the screen, with a longest edge of at most so many pixels. Rejects with a DOMException. */
  poster(longest_px: number): Promise<Blob>;
}

/** The handles of cuts and lamps in the picture. */
export interface HandleLights {
  /** Lights up a handle; null: none. */
  highlight(handle: HandleId | null): void;
}

/** The measured points. */
export interface MeasuredPoints {
  /** For each measured point the values of the shown channels that have come, as `DAPI 1210`. */
  readonly values: readonly (readonly string[])[];
}

/** The panel in the page. */
export interface PagePanel {
  /** Grants a request of the panel or of a card. */
  perform(request: Request | Refusal): void;
  /** Brings the keyboard to a control, also of a panel that is hidden. Returns whether there is one. */
  focus(section: string, control: string): boolean;
  /** Shows words on the page alone. */
  say(words: string): void;
  /** Offers a button beside the words that were announced last. */
  offer(words: string, label: string, act: () => void): void;
}

/** The buttons that lead on from a refusal. */
export interface MessageButtons {
  /** null: nothing leads on. */
  buttonFor(refusal: string): Promise<Readonly<{ label: string; act: () => void }> | null>;
}

/** The channels' volumes. */
export interface Volumes {
  /** Where a channel's volume in a tile comes from; null: not known yet, or there is none. */
  source(tile: string, channel: string): VolumeSource | null;
  /** The same, once it is known; null also after a fault, which was reported. */
  sourceOf(tile: string, channel: string): Promise<VolumeSource | null>;
  /** All volumes of a channel, by tile; null: its list has not come, which was reported. */
  sourcesOf(channel: string): Promise<ReadonlyMap<string, VolumeSource> | null>;
  /** Outermost points (um, world) of what a channel shows as volumes; null: not all has come. */
  outline(channel: string): readonly Vec3[] | null;
  /** How far the volume of a channel in a tile has faded in, 0..1. */
  presence(tile: string, channel: string): number;
  /** Whether all that is marched shows in the disc alone. */
  readonly isInDisc: boolean;
  readonly appearances: Readonly<{ of: (state: ViewerState, channel: string) => Appearance }>;
}

/** What the texels of volumes may take, and where they come from. */
export type VolumeTexels = Readonly<{
  limits: VolumeLimits;
  /** From a host that sends bricks by view; null: volumes come as files. */
  bricks: BrickService | null;
}>;

export type LoadedSurface = Readonly<{ scene: Object3D; tile: string; blend: BlendedSurface }>;

/** The channels' surfaces. */
export interface Surfaces {
  /** The meshes on screen. */
  readonly meshes: readonly ShownSurface[];
  /** All that have come of a channel. */
  of(channel: string): readonly LoadedSurface[];
  /** Calls back when another one has come. */
  onLoaded(listener: (channel: string, surface: LoadedSurface) => void): void;
  /** Outermost points (um, world) of a channel's surfaces; null: not known yet. */
  outline(channel: string): readonly Vec3[] | null;
}

/** The stereo that browser and device offer. */
export interface StereoFinder {
  readonly found: Promise<Readonly<{ stereo: XrSupport; hasRoom: boolean }>>;
}

/** Links to the view, for a part that shares it in another way. */
export type LinkCode = Readonly<{
  /** The link to the present view. */
  link: () => string;
  /** What a link changes, and from where it looks; null: as the view opens. */
  read: (
    link: string,
    state: ViewerState,
  ) => Readonly<{ actions: readonly Action[]; camera: CameraView | null }>;
}>;
export interface Links {
  /** Loads the code that writes and reads links. */
  load(): Promise<LinkCode>;
  /** Brings the page's address to the view at once, as before a reload. */
  writeAddress(): void;
}

/** What the benchmark has found. */
export interface BenchResult {
  /** null: it has not been run. */
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
