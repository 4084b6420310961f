/** The uniforms that the marches of all tiles share in a frame: light, eye, disc and steps. */
import {
  type Data3DTexture,
  DataTexture,
  type DepthTexture,
  Matrix4,
  NearestFilter,
  RedFormat,
  RepeatWrapping,
  type Texture,
  UnsignedByteType,
  Vector2,
  Vector3,
  Vector4,
} from "three";
import { blueNoise, NOISE_SIZE } from "../gpu/blue_noise";
import { GLOSS, OWN_LIGHT, type RoomLight } from "../gpu/room_light";

/** Most steps of a ray while anything moves, for any size of the volume and any number of tiles. */
export const MAX_STEPS = 100;
/** Most steps of a ray at rest: one a voxel through 512 of them. */
export const REST_STEPS = 512;
/** The light on all tiles: see gpu/chunks/shade.glsl. The directions are in the axes of the eye. */
export type MarchLight = ReturnType<typeof marchLight>;

/** Uniforms of a light that is still dark. */
export function marchLight() {
  return {
    uLight: { value: new Vector3() },
    uFill: { value: new Vector3() },
    uKeyLight: { value: new Vector3() },
    uFillLight: { value: new Vector3() },
    uSkyLight: { value: new Vector3() },
    uGroundLight: { value: new Vector3() },
    uGloss: { value: GLOSS },
  };
}

/**
 * The room's light, which surfaces have too.
 *
 * @param toEye from the axes that the lamps stand in to those of the eye
 */
export function lightByRoom(
  light: MarchLight,
  { key, fill, sky, ground }: RoomLight,
  toEye: Matrix4,
): void {
  light.uLight.value.set(...key.towards).transformDirection(toEye);
  light.uFill.value.set(...fill.towards).transformDirection(toEye);
  light.uKeyLight.value.set(...key.light);
  light.uFillLight.value.set(...fill.light);
  light.uSkyLight.value.set(...sky);
  light.uGroundLight.value.set(...ground);
  light.uGloss.value = GLOSS;
}

/** Uniforms that all tiles share in a frame, by reference. */
export type MarchFrame = Readonly<{
  uSceneDepth: { value: DepthTexture };
  /** The depth of the nearest translucent surface, if there is one. */
  uPaneDepth: { value: DepthTexture };
  uHasPane: { value: boolean };
  uNoise: { value: Texture };
  /** By how much the noise is shifted in this frame, 0..1. */
  uPhase: { value: number };
  /** The eye's part of the picture, and of the march: x, y, width, height in pixels of each. */
  uEye: { value: Vector4 };
  uPart: { value: Vector4 };
  /** Tangents from the eye's axis by its clip space: factor, offset; 0: it looks through no lens. */
  uLens: { value: Vector4 };
  /** Cosines of the disc's inner and outer radius; below -1 the disc is everything. */
  uDisc: { value: Vector2 };
  /** Cosine of the radius within which the disc is marched. */
  uReach: { value: number };
  /** Whether all that is marched shows in the disc alone: then its picture is mixed with the surfaces'. */
  uIsCrossing: { value: boolean };
  uSteps: { value: number };
  /** Light that comes to each cell of a coarse grid, and by how much it counts, 0..1. */
  uReached: { value: Data3DTexture | null };
  uDepthShading: { value: number };
  /** Factor to the opacities' optical depth. */
  uDensity: { value: number };
}> &
  MarchLight;

/** Depth of what is opaque, and of the nearest that is translucent. */
export function makeFrame(depth: DepthTexture, pane = depth): MarchFrame {
  const noise = new DataTexture(blueNoise(), NOISE_SIZE, NOISE_SIZE, RedFormat, UnsignedByteType);
  noise.wrapS = noise.wrapT = RepeatWrapping;
  noise.minFilter = noise.magFilter = NearestFilter;
  noise.needsUpdate = true;
  const light = marchLight();
  lightByRoom(light, OWN_LIGHT, new Matrix4());
  return {
    ...light,
    uSceneDepth: { value: depth },
    uPaneDepth: { value: pane },
    uHasPane: { value: false },
    uNoise: { value: noise },
    uPhase: { value: 0 },
    uEye: { value: new Vector4(0, 0, 1, 1) },
    uPart: { value: new Vector4(0, 0, 1, 1) },
    uLens: { value: new Vector4(0, 0, 0, 0) },
    uDisc: { value: new Vector2(-2, -3) },
    uReach: { value: -1 },
    uIsCrossing: { value: false },
    uSteps: { value: MAX_STEPS },
    uReached: { value: null },
    uDepthShading: { value: 0 },
    uDensity: { value: 1 },
  };
}
