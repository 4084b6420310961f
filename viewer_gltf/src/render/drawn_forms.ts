/**
 * Interfaces of the drawings that a frame combines with its surfaces: ray-marched and path-traced
 * volumes.
 */
import type { Matrix4, Scene, Texture, Vector3, WebGLRenderer } from "three";
import type { Bounds } from "../bundle/generated/bundle";
import type { MarchClip } from "../gpu/clip_uniforms";
import type { Eyes } from "../gpu/eyes";
import type { ShownVolume } from "../state/on_screen";
import type { MarchLight } from "../voxels/march_frame";

/**
 * Where a frame is seen from, in um of the world: the apex and axis of the disc's cone, and `lamp`,
 * the direction towards the light.
 */
export type MarchView = Readonly<{
  eye: Vector3;
  apex: Vector3;
  axis: Vector3;
  clip: MarchClip;
  lamp: Vector3;
}>;

/** The ray marches of the tiles that are on screen. */
export interface DrawnMarches {
  readonly scene: Scene;
  readonly isEmpty: boolean;
  /** Whether all marched volumes show only inside the disc. */
  readonly isInDisc: boolean;
  /** Whether some marched volumes show only inside the disc and others everywhere. */
  readonly isPartlyInDisc: boolean;
  /** Restricts all marches to the disc's cone, or lets each channel show where it should. */
  endAtDisc(ends: boolean): void;
  /** Sets the pose of the specimen in the scene; the volumes lie in the specimen's world. */
  placeAs(specimen: Matrix4): void;
}

export type VolumeStatus = Readonly<{
  tile: string;
  channel: string;
  /** Mip level on screen, 0 is the finest; null before any is loaded. */
  level: number | null;
}>;

export interface MarchedVolumes {
  readonly marches: DrawnMarches;
  /** A text that changes when a march would look different. */
  readonly marchKey: string;
  /** Bytes on the GPU. */
  readonly bytes: number;
  aim(view: MarchView): void;
  /** Whether all wanted volumes of a tile are loaded, at any mip level. */
  isReady(tile: string): boolean;
  shown(): readonly ShownVolume[];
  status(): readonly VolumeStatus[];
}

/** The scene around the traced medium. */
export type TraceScene = Readonly<{
  /** From um of the bundle's world, before the tiles' matrices, to the scene. */
  specimen: Matrix4;
  clip: MarchClip;
  /** A number that changes when the opaque objects change. */
  solids: number;
  /** The specimen's box, um; lamps are placed relative to it. */
  bounds: Bounds;
}>;

/** A ray-marched frame of the same view, linear and premultiplied. */
export type MarchedFrame = Readonly<{
  image: Texture;
  /** Pixels of the marched frame for each pixel of the frame buffer, along an edge. */
  scale: number;
}>;

/** How much work the path tracing of a frame may take. */
export type TracePace = Readonly<{
  /** Pixels that the time budget allows for each pixel of the frame, along an edge, 0 to 1. */
  resolution: number;
  isMoving: boolean;
  /**
   * Path-traced samples that are added to each pixel; below 1, the share of the pixels that get
   * one.
   */
  passes: number;
  /** The ray march of the same view, shown until path tracing has an image; null: none. */
  standIn: MarchedFrame | null;
}>;

export interface TracedVolumes {
  readonly isShown: boolean;
  /** Whether a view at rest still gathers samples. */
  readonly isGathering: boolean;
  /** Whether the last frame has drawn a path-traced volume. */
  readonly isOnScreen: boolean;
  /** Whether path tracing alone was shown, without the ray march. */
  readonly standsAlone: boolean;
  /** Lights the stand-in ray march like the path tracing. */
  lightMarch(march: MarchLight, specimen: Matrix4, head: Matrix4): void;
  render(renderer: WebGLRenderer, eyes: Eyes, scene: TraceScene, pace: TracePace): void;
  hide(): void;
  shown(): readonly ShownVolume[];
  /** Samples per pixel, and the mip level; null: nothing is traced. */
  status(): Readonly<{ samples: number; level: number | null }>;
}
