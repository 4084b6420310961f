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
import { GLOSS, OWN_LIGHT, type SceneLight } from "../gpu/scene_light";

/**
 * Largest number of steps of a ray in a moving view, for any size of the volume and number of
 * tiles.
 */
export const MAX_STEPS = 100;
/** Largest number of steps of a ray at rest: at most a voxel long through 512 voxels. */
export const REST_STEPS = 512;
/** The light on all tiles; see gpu/chunks/shade.glsl. Directions are in the eye's axes. */
export type MarchLight = ReturnType<typeof marchLight>;

/** Uniforms of a light, initially dark. */
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
 * Sets the light from that of the scene, which surfaces use too.
 *
 * @param toEye from the axes of the lamps to those of the eye
 */
export function lightByScene(
  light: MarchLight,
  { key, fill, sky, ground }: SceneLight,
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
  /** Depth of the nearest translucent surface, if there is one. */
  uPaneDepth: { value: DepthTexture };
  uHasPane: { value: boolean };
  uNoise: { value: Texture };
  /** Shift of the noise in this frame, 0 to 1. */
  uPhase: { value: number };
  /** The eye's part of the frame, and of the march: x, y, width, height in pixels of each. */
  uEye: { value: Vector4 };
  uPart: { value: Vector4 };
  /** Tangents from the eye's axis for clip space: factor, offset; 0: no lens. */
  uLens: { value: Vector4 };
  /** Cosines of the disc's inner and outer radius; below -1 the disc covers everything. */
  uDisc: { value: Vector2 };
  /** Cosine of the radius within which the disc is marched. */
  uReach: { value: number };
  /**
   * Whether all marched volumes show only inside the disc, so that their image is mixed with that
   * of the surfaces.
   */
  uIsCrossing: { value: boolean };
  uSteps: { value: number };
  /** Light that reaches each cell of a coarse grid, and the strength of this shading, 0 to 1. */
  uReached: { value: Data3DTexture | null };
  uDepthShading: { value: number };
  /** Factor of the opacities' optical depth. */
  uDensity: { value: number };
}> &
  MarchLight;

/**
 * Makes the uniforms.
 * @param depth depth of opaque objects
 * @param pane depth of the nearest translucent surface
 */
export function makeFrame(depth: DepthTexture, pane = depth): MarchFrame {
  const noise = new DataTexture(blueNoise(), NOISE_SIZE, NOISE_SIZE, RedFormat, UnsignedByteType);
  noise.wrapS = noise.wrapT = RepeatWrapping;
  noise.minFilter = noise.magFilter = NearestFilter;
  noise.needsUpdate = true;
  const light = marchLight();
  lightByScene(light, OWN_LIGHT, new Matrix4());
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
