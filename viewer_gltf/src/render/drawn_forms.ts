/** The ways to draw the specimen that a frame puts together with its surfaces, as the frame sees them. */
import type { Matrix4, Scene, Texture, Vector3, WebGLRenderer } from "three";
import type { Bounds } from "../bundle/generated/bundle";
import type { MarchClip } from "../gpu/clip_uniforms";
import type { Eyes } from "../gpu/eyes";
import type { ShownVolume } from "../state/on_screen";
import type { MarchLight } from "../voxels/march_frame";

/** Where a frame is seen from: um, world. The disc's cone has an apex and an axis; `lamp` is the direction towards it. */
export type MarchView = Readonly<{
  eye: Vector3;
  apex: Vector3;
  axis: Vector3;
  clip: MarchClip;
  lamp: Vector3;
}>;

/** The marches of the tiles that are on screen. */
export interface DrawnMarches {
  readonly scene: Scene;
  /** Whether anything is to be marched. */
  readonly isEmpty: boolean;
  /** Whether all that is marched shows in the disc alone. */
  readonly isInDisc: boolean;
  /** Whether of what is marched some shows in the disc alone, and some beyond it too. */
  readonly isPartlyInDisc: boolean;
  /** Marches what lies in the disc's cone alone, whatever the channels; false: as each shows. */
  endAtDisc(ends: boolean): void;
  /** The volumes lie in the specimen's world; `specimen` is its pose in the scene. */
  placeAs(specimen: Matrix4): void;
}

export type VolumeStatus = Readonly<{
  tile: string;
  channel: string;
  /** Mip level on screen, 0 is the finest; null: none yet. */
  level: number | null;
}>;

/** The volumes that are marched. */
export interface MarchedVolumes {
  readonly marches: DrawnMarches;
  /** A text that changes with what a march would draw. */
  readonly marchKey: string;
  /** Bytes on the GPU. */
  readonly bytes: number;
  /** Called before every frame. */
  aim(view: MarchView): void;
  /** Whether all that is wanted of a tile is there, at some level. */
  isReady(tile: string): boolean;
  shown(): readonly ShownVolume[];
  status(): readonly VolumeStatus[];
}

/** What is traced, besides the medium. */
export type TraceScene = Readonly<{
  /** From um of the bundle's world, before tiles' matrices, to the room. */
  specimen: Matrix4;
  clip: MarchClip;
  /** A number that changes with what is opaque in the room. */
  solids: number;
  /** The specimen's box, um: lamps are placed by it. */
  bounds: Bounds;
}>;

/** A marched frame of the same view, linear and premultiplied. */
export type MarchedFrame = Readonly<{
  picture: Texture;
  /** Its pixels to one of the frame buffer. */
  scale: number;
}>;

/** How a frame is traced. */
export type TracePace = Readonly<{
  /** Share of the pixels that the frame's budget allows, 0..1. */
  resolution: number;
  isMoving: boolean;
  /** Samples of every pixel. */
  passes: number;
  /** The march of the same view; null: there is none. */
  standIn: MarchedFrame | null;
}>;

/** The volumes that are drawn by paths of light. */
export interface TracedVolumes {
  /** Whether there is anything to draw. */
  readonly isShown: boolean;
  /** Whether a view at rest still gathers samples. */
  readonly isGathering: boolean;
  /** Whether the last frame has drawn it. */
  readonly isOnScreen: boolean;
  /** Whether it was shown alone: nothing was seen of the march. */
  readonly standsAlone: boolean;
  /** Lights the march that stands in as paths of light do. */
  lightMarch(march: MarchLight, specimen: Matrix4, head: Matrix4): void;
  render(renderer: WebGLRenderer, eyes: Eyes, scene: TraceScene, pace: TracePace): void;
  hide(): void;
  shown(): readonly ShownVolume[];
  /** Samples of a pixel, and the mip level; null: nothing is traced. */
  status(): Readonly<{ samples: number; level: number | null }>;
}
