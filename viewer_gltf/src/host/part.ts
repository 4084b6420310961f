/** The interface between the host and the features of the viewer, its parts. */
import type { Matrix4, Object3D, PerspectiveCamera, Vector2, Vector3, WebGLRenderer } from "three";
import type { Bundle } from "../bundle/load";
import type { ValuesHost } from "../bundle/values_host";
import type { Target } from "../interaction/ray_pointer";
import type { Sight } from "../marks/style";
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

/** A flat picture. */
export type FlatScreen = Readonly<{
  camera: PerspectiveCamera;
  /** CSS pixels. */
  height_px: number;
  /** The point that is looked at, in the scene, m: the scale bar is true there. */
  focus: Vector3;
}>;

/** From where the specimen is seen in a frame. */
export type FrameView = Readonly<{
  /** Pose of the head or of the mono camera, room. */
  head: Matrix4;
  /** From um to the room. */
  specimen: Matrix4;
  /** null in stereo. */
  screen: FlatScreen | null;
  /** Straight ahead, um. */
  gaze: Ray;
  /** Where volumes show in disc mode. */
  disc: Cone | null;
  /** The panel lies beside the specimen, and ruler and axes would lie across it. */
  isPanelOpen: boolean;
  /** The bar of stereo hangs below the specimen. */
  isBarBelow: boolean;
  /** The eye in the specimen's space. */
  sight: Sight;
  dt_s: number;
}>;

/** A part's objects in the scene, and how the passes of a frame treat them. */
export type PartScene = Readonly<{
  /** Hangs in the specimen's space: um, world. */
  group: Object3D;
  /** Objects that the pass for the depth leaves out. */
  overlays: readonly Object3D[];
  /** A number that changes with what the part hides; 0: nothing. */
  solid: number;
  /** Whether the objects fill the picture even where no channel shows. */
  isStanding: boolean;
}>;

/** The place where a ray meets a part. */
export type Hit = Probed &
  Readonly<{
    /** The object of a label map that is met; absent: the hit is none. */
    object?: Readonly<{ row: number; name: string; label: string | null }>;
  }>;

/** A choice by pointer, key, hand or resting gaze; the ray is in um of the specimen. */
export type Tap = Readonly<{
  ray: Ray;
  by: "pointer" | "key" | "hand" | "gaze";
  /** On the page's clock. */
  time_ms: number;
}>;

/** "used": nothing else is to happen; "met": the part has done something, and a tile may be chosen, too. */
export type TapAnswer = "used" | "met" | null;

/** Functions by the name of the command. One that returns false leaves the command to others. */
export type CommandTable = Readonly<Partial<Record<Command, () => unknown>>>;

/**
 * One feature of the viewer. The host calls these; a part never calls the host's other parts. What a part asks of the
 * host is at most two dots away from it: scripts/reach.ts holds that.
 */
export interface Part {
  readonly id: string;
  /** Called once, when all parts of the list are made. */
  begin?(): void;
  /** Called once, when the view that the address asks for is open. */
  afterOpening?(): unknown;
  /** Called once, when the overview is on screen: then comes what nobody needs before the first picture. */
  afterOverview?(): unknown;
  /** Brings the part to a state; called after every change, and at the start. */
  sync?(state: ViewerState, previous: ViewerState): void;
  /** Animation, before each frame. */
  advance?(frame: FrameView): void;
  readonly scene?: PartScene;
  /** Planes before which the specimen is cut away for an eye, um. */
  cutBefore?(eye: Vec3): readonly ClipPlane[] | undefined;
  /** The nearest place where a ray (um) meets the part; null: none. */
  pick?(ray: Ray): Hit | null;
  /** Hears of every choice in the picture, before it has an effect. */
  hearTap?(tap: Tap): void;
  tap?(tap: Tap): TapAnswer;
  /** A choice on the flat screen that no part has used. */
  openCard?(tap: Tap): void;
  /** Targets of gaze and hands in stereo. */
  readonly targets?: readonly Target[];
  readonly commands?: CommandTable;
  /** Commands of the page, which do nothing in stereo. */
  readonly pageCommands?: CommandTable;
  panel?(view: PanelView): readonly PartSection[];
  readonly services?: Partial<Services>;
  /** A way to draw the specimen. */
  readonly form?: Form;
  readonly isLoading?: boolean;
  /** Asks again for what has failed. */
  retryFailed?(): void;
  dispose(): void;
}

/** A part as it is registered. */
export type PartDefinition = Readonly<{
  id: string;
  keys?: readonly KeyGroup[];
  /** Place among the parts that are made and follow changes first; absent: after those. */
  rank?: number;
  /** Whether the part traces paths of light on a device. */
  canTrace?: (gl: WebGLRenderingContext | WebGL2RenderingContext) => boolean;
  /** Names of commands that no other part has. Each has a key. */
  commands?: readonly Command[];
  /** The settings and actions that the part adds to the state. */
  settings?: PartSettings;
  /** Buttons that lead on from the part's refusals. */
  remedies?: Remedies;
  create: (host: PartHost) => Part;
}>;

/** The scene and all that draws it. */
export interface Display {
  readonly renderer: WebGLRenderer;
  readonly studio: StillMaker;
  /** CSS pixels in an inch of this screen; null: guessed from the browser's name. */
  readonly cssPixelsPerInch: number | null;
  setScreen(perInch: number | null): void;
  /** Something has come for the picture, which may be at rest. */
  requestFrame(): void;
  /** The picture has to change at once. */
  redraw(): void;
  /** Brings the canvas to the size of the stage. */
  fit(): void;
  /** Draws volumes of at most so many voxels along a tile's edge. */
  limitEdge(edge: number): void;
  /** Frames drawn so far. */
  readonly frames: number;
  /** Whether the picture moves now, and its frames are late. */
  readonly isLate: boolean;
  /** Resolves when the next frame has been drawn. */
  nextFrame(): Promise<void>;
  /** Resolves when nothing loads any more and the picture shows all of it. */
  settled(): Promise<void>;
  readonly isLoading: boolean;
  snapshot(): Snapshot;
}

/** The uniforms that the shaders of a frame share by reference, and the place where a form adds objects over the scene. */
export type SharedFrame = Pick<FrameRenderer, "marchFrame" | "surfaceFrame" | "sceneDepth" | "add">;

/** The host as the parts see it. */
export interface PartHost {
  readonly bundle: Bundle;
  readonly state: ViewerState;
  /** Holds the canvas. */
  readonly stage: HTMLElement;
  readonly canvas: HTMLCanvasElement;
  /** The part of the page with the stage. */
  readonly view: HTMLElement;
  readonly display: Display;
  /** The object of the scene that holds the specimen: from um to the room. */
  readonly specimen: Object3D;
  readonly viewpoint: Viewpoint;
  readonly stereo: Stereo;
  readonly reading: Reading;
  readonly focus: Focus;
  readonly frame: SharedFrame;
  /** Voxels as they were measured; null: the page's host has none. */
  readonly values: ValuesHost | null;
  readonly panel: PanelModel;
  readonly undo: Undo;
  readonly keys: KeyTable;
  readonly remedies: Remedies;
  readonly changed: Signal<ViewerState>;
  readonly drawn: Signal<void>;
  /** Words to say on the page; the host says them in stereo. */
  readonly announced: Signal<string>;
  /** The control with which a card begins that a tap or a key has opened. */
  readonly revealed: Signal<string>;
  /** A second quick tap asks to fly there, so the first one was no choice. */
  readonly doubleTapped: Signal<void>;
  /** The user has chosen another lens profile in stereo. */
  readonly lensesChosen: Signal<Lenses>;
  /** Whether the user is in stereo, where the page is not seen. */
  readonly isInRoom: boolean;
  /** @param isStep whether undoing goes back to before it */
  dispatch(action: Action, isStep?: boolean): void;
  /** Returns whether the command could be carried out. */
  run(command: Command): boolean;
  announce(text: string): void;
  /** Shows a fault of the bundle or the network; throws any other error. */
  report(error: unknown): void;
  /** The ray (um) under a point of the screen, -1..1. */
  rayAt(point: Vector2): Ray;
  /** A part's service; null: no part offers it. */
  service<K extends keyof Services>(name: K): Services[K] | null;
  /** The nearest object of a label map along a ray, um; null: none. */
  objectAlong(ray: Ray): Hit | null;
  /** Whether a part shows something besides surfaces and volumes. */
  readonly hasStandingPart: boolean;
}
