/** The interface between the host and the features of the viewer, its parts. */
import type { Matrix4, Object3D, PerspectiveCamera, Vector2, Vector3, WebGLRenderer } from "three";
import type { Bundle } from "../bundle/load";
import type { ValuesHost } from "../bundle/values_host";
import type { Target } from "../interaction/ray_pointer";
import type { EyeView } from "../marks/style";
import type { ClipPlane } from "../math/clip";
import type { Ray, Vec3 } from "../math/vec3";
import type { Lenses, PanelView, PartSection } from "../panel/controls";
import type { KeyGroup } from "../panel/key";
import type { KeyTable } from "../panel/keys";
import type { Remedies } from "../panel/remedies";
import type { Cone, Probed } from "../probe/probe";
import type { Reading } from "../probe/probe_reader";
import type { FrameRenderer } from "../render/frame_renderer";
import type { Action } from "../state/actions";
import type { Command } from "../state/commands";
import type { PartSettings } from "../state/part_settings";
import type { Signal } from "../state/signal";
import type { ViewerState } from "../state/viewer_state";
import type { Stereo } from "../xr/stereo";
import type { Focus, Form } from "./form";
import type { PanelModel } from "./panel_model";
import type { Services } from "./services";
import type { Snapshot } from "./snapshot";
import type { StillMaker } from "./still";
import type { Undo } from "./undo";
import type { Viewpoint } from "./viewpoint";

/** The flat view on the screen. */
export type FlatScreen = Readonly<{
  camera: PerspectiveCamera;
  /** Height in CSS pixels. */
  height_px: number;
  /** The point that the camera turns around, in metres of the scene. The scale bar is exact there. */
  focus: Vector3;
}>;

/** Pose of the viewer and the specimen in a frame. */
export type FrameView = Readonly<{
  /** Pose of the head or of the flat camera, in the scene. */
  head: Matrix4;
  /** Matrix from um to metres of the scene. */
  specimen: Matrix4;
  /** The flat view; null in stereo. */
  screen: FlatScreen | null;
  /** Ray straight ahead, um. */
  gaze: Ray;
  /** The cone in which volumes are shown in disc mode. */
  disc: Cone | null;
  /**
   * Whether the panel is open beside the specimen. Ruler and axes are hidden then, because they
   * would cross it.
   */
  isPanelOpen: boolean;
  /** Whether the bar of stereo is below the specimen. */
  isBarBelow: boolean;
  /** The eye in the space of the specimen. */
  eyeView: EyeView;
  dt_s: number;
}>;

/** The objects of a part in the scene, and how the passes of a frame treat them. */
export type PartScene = Readonly<{
  /** Group in the space of the specimen: um, world. */
  group: Object3D;
  /** Objects that the depth pass leaves out, so that they do not hide volumes behind them. */
  overlays: readonly Object3D[];
  /** A number that changes when the part's opaque objects change; 0: it has none. */
  solid: number;
  /** Whether the objects are visible even if no channel is shown. */
  isStanding: boolean;
}>;

/** The point where a ray hits something that a part of the viewer shows. */
export type Hit = Probed &
  Readonly<{
    /** The object of a label map that is hit; absent: none. */
    object?: Readonly<{ row: number; name: string; label: string | null }>;
  }>;

/** A choice by pointer, key, hand or resting gaze; the ray is in um of the specimen. */
export type Tap = Readonly<{
  ray: Ray;
  by: "pointer" | "key" | "hand" | "gaze";
  /** Time of the choice on the clock of the page's events, ms. */
  time_ms: number;
}>;

/**
 * "used": nothing else happens; "shared": the part has done something, and a tile may still be
 * selected; null: no hit.
 */
export type TapAnswer = "used" | "shared" | null;

/**
 * Functions by the name of the command. If a function returns false, the other parts
 * get the command.
 */
export type CommandTable = Readonly<Partial<Record<Command, () => unknown>>>;

/**
 * One feature of the viewer. The host calls these members; a part never calls the host's other
 * parts. A part reaches at most two properties deep into the host, which scripts/reach.ts checks.
 *
 * ```ts
 * import type { PartDefinition } from "./part";
 *
 * // Announces how many channels are shown, after each change.
 * export const channelCount: PartDefinition = {
 *   id: "channel-count",
 *   create(host) {
 *     const count = () => host.state.channels.filter(({ shown }) => shown).length;
 *     return {
 *       id: "channel-count",
 *       sync(state, previous) {
 *         if (state.channels !== previous.channels) host.announce(`Channels shown: ${count()}`);
 *       },
 *       dispose: () => undefined,
 *     };
 *   },
 * };
 * ```
 */
export interface Part {
  readonly id: string;
  /** Called once, when all parts have been made. */
  begin?(): void;
  /** Called once, when the viewer has the settings and the camera of the page's address. */
  afterOpening?(): unknown;
  /** Called once, when the overview is on screen. Parts load here what the first view does not need. */
  afterOverview?(): unknown;
  /** Updates the part to a state; called after every change, and at the start. */
  sync?(state: ViewerState, previous: ViewerState): void;
  /** Advances animations, before each frame. */
  advance?(frame: FrameView): void;
  readonly scene?: PartScene;
  /**
   * Returns clip planes for an eye (um). Everything between the eye and such a plane is not drawn.
   */
  cutBefore?(eye: Vec3): readonly ClipPlane[] | undefined;
  /** Returns the nearest hit of a ray (um); null: none. */
  pick?(ray: Ray): Hit | null;
  /** Called for every choice in the view, before it has an effect. */
  onTap?(tap: Tap): void;
  tap?(tap: Tap): TapAnswer;
  /** Called for a choice on the flat screen that no part has used. */
  openCard?(tap: Tap): void;
  /** Targets of gaze and hands in stereo. */
  readonly targets?: readonly Target[];
  readonly commands?: CommandTable;
  /** Commands of the page, which are not available in stereo. */
  readonly pageCommands?: CommandTable;
  panel?(view: PanelView): readonly PartSection[];
  readonly services?: Partial<Services>;
  /** A way to draw the specimen. */
  readonly form?: Form;
  readonly isLoading?: boolean;
  /** Requests again what has failed. */
  retryFailed?(): void;
  dispose(): void;
}

/** The data by which a part of the viewer is registered, and the function that makes the part. */
export type PartDefinition = Readonly<{
  id: string;
  keys?: readonly KeyGroup[];
  /** Order in which parts are made and updated; absent: after all parts with a rank. */
  rank?: number;
  /** Returns whether the part can trace paths on a device. */
  canTrace?: (gl: WebGLRenderingContext | WebGL2RenderingContext) => boolean;
  /** Names of commands that no other part has. Each has a key. */
  commands?: readonly Command[];
  /** Settings and actions that the part adds to the state. */
  settings?: PartSettings;
  /** By the text of a refusal, the button that removes its cause. */
  remedies?: Remedies;
  create: (host: PartHost) => Part;
}>;

/** The scene and everything that draws it. */
export interface Display {
  readonly renderer: WebGLRenderer;
  readonly studio: StillMaker;
  /** CSS pixels per inch of this screen; null: estimated from the name of the browser. */
  readonly cssPixelsPerInch: number | null;
  setScreen(perInch: number | null): void;
  /** Draws again soon, because something was loaded; the view may be unchanged. */
  requestFrame(): void;
  /** Draws again at once. */
  redraw(): void;
  /** Sets the size of the canvas to that of the stage. */
  fit(): void;
  /** Limits volumes to a number of voxels along a tile's edge. */
  limitEdge(edge: number): void;
  /** Number of frames drawn so far. */
  readonly frames: number;
  /** Whether the view is moving now, and its frames are late. */
  readonly isLate: boolean;
  /** Resolves when the next frame has been drawn. */
  nextFrame(): Promise<void>;
  /** Resolves when nothing is loading and the view shows everything. */
  settled(): Promise<void>;
  readonly isLoading: boolean;
  snapshot(): Snapshot;
}

/**
 * The uniforms that the shaders of a frame share by reference, and the function by which a form
 * adds objects to the scene.
 */
export type SharedFrame = Pick<FrameRenderer, "marchFrame" | "surfaceFrame" | "sceneDepth" | "add">;

/** The host as the parts see it. */
export interface PartHost {
  readonly bundle: Bundle;
  readonly state: ViewerState;
  /** Contains the canvas. */
  readonly stage: HTMLElement;
  readonly canvas: HTMLCanvasElement;
  /** The part of the page with the stage. */
  readonly view: HTMLElement;
  readonly display: Display;
  /** The scene object that contains the specimen; its matrix maps um to metres of the scene. */
  readonly specimen: Object3D;
  readonly viewpoint: Viewpoint;
  readonly stereo: Stereo;
  readonly reading: Reading;
  readonly focus: Focus;
  readonly frame: SharedFrame;
  /** Voxel values as they were measured; null: the host of the page does not serve them. */
  readonly values: ValuesHost | null;
  readonly panel: PanelModel;
  readonly undo: Undo;
  readonly keys: KeyTable;
  readonly remedies: Remedies;
  readonly changed: Signal<ViewerState>;
  readonly drawn: Signal<void>;
  /** Announcements for the page. In stereo, the host announces them itself. */
  readonly announced: Signal<string>;
  /** Id of the first control of a card that a tap or a key has opened. */
  readonly revealed: Signal<string>;
  /** Emitted after a double tap, which flies to the place. Its first tap was then not a choice. */
  readonly doubleTapped: Signal<void>;
  /** The user has chosen another lens profile in stereo. */
  readonly lensesChosen: Signal<Lenses>;
  /** Whether the user is in stereo, where the page is not visible. */
  readonly isInStereo: boolean;
  /** @param isStep whether the action is a step that undo takes back */
  dispatch(action: Action, isStep?: boolean): void;
  /** Runs a command. Returns whether that was possible. */
  run(command: Command): boolean;
  announce(text: string): void;
  /** Shows a fault of the bundle or the network as a notice; throws any other error. */
  report(error: unknown): void;
  /** Returns the ray (um) under a point of the screen, -1..1. */
  rayAt(point: Vector2): Ray;
  /** Returns a service by its name; null: no part offers it. */
  service<K extends keyof Services>(name: K): Services[K] | null;
  /** Returns the nearest object of a label map along a ray (um); null: none. */
  objectAlong(ray: Ray): Hit | null;
  /** Whether a part shows anything besides surfaces and volumes. */
  readonly hasStandingPart: boolean;
}
