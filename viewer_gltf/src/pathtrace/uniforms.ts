/** The path tracer's uniforms: the medium, the scene, its light and its paths. */

import { Matrix3, Matrix4, type Texture, Vector2, Vector3, Vector4 } from "three";
import type { Bounds } from "../bundle/generated/bundle";
import { SKIP_BRICK } from "../bundle/generated/constants";
import { clipInto, noCorner } from "../gpu/clip_uniforms";
import type { Eyes } from "../gpu/eyes";
import { nothing } from "../gpu/float_targets";
import type { TraceScene } from "../render/drawn_forms";
import { LAMPS, type TraceSettings } from "../state/path_trace_settings";
import { tableUniforms } from "../voxels/transfer_table_2d";
import { turnOf } from "./eye_rays";
import type { MediumTexels } from "./medium_loader";
import type { BlockFrame } from "./texel_frame";

/** Largest light of a path; half-precision floats end at 65504. */
const MAX_LIGHT = 60_000;
/** Largest light of a path while the view moves; frames with few samples would otherwise have bright dots. */
const MAX_LIGHT_MOVING = 200;
/** Largest number of scatterings of a path; a medium that absorbs nothing would not end it. */
const MAX_SCATTERS = 512;
/** Largest number of scatterings while the view moves; the environment's mean replaces the rest of the path. */
const FEW_SCATTERS = 16;
/** Exponent of a shiny surface's lobe. */
const GLOSS = 60;

/** Radius of a lamp, as a share of the longest edge of the box. */
const LAMP_RADIUS = 0.08;
const OCCLUSION_REACH = 0.06;

/** Returns a key of the settings on which the gathered samples depend; they are dropped when it changes. */
export function keyOf(
  { width_px, height_px }: Eyes,
  scene: TraceScene,
  scale: number,
  isDraft: boolean,
): string {
  return `${width_px} ${height_px} ${scale} ${isDraft} ${matterOf(scene)}`;
}

/** Returns a key of the scene apart from the medium: opaque objects and cuts. */
export function matterOf({ solids, clip }: TraceScene): string {
  return `${solids} ${JSON.stringify(clip)}`;
}

export type TraceUniforms = ReturnType<typeof traceUniforms>;

export function sumUniforms() {
  return { uSums: nothing(), uMoments: nothing() };
}

export function traceUniforms(uSceneDepth: { value: Texture }, mostHistory: number) {
  return {
    ...sumUniforms(),
    uNoisiness: nothing(),
    uSize: { value: new Vector3(1, 1, 1) },
    uTexLow: { value: new Vector3() },
    uTexPerUm: { value: new Vector3(1, -1, 1) },
    uVoxel: { value: 1 },
    uTexels: { value: new Vector3(1, 1, 1) },
    uVolume: nothing(),
    uIndex: nothing(),
    uMedium: nothing(),
    ...tableUniforms(),
    uMajorants: nothing(),
    uBrick: { value: new Vector3(SKIP_BRICK, SKIP_BRICK, SKIP_BRICK) },
    uStride: { value: 0 },
    uClipLow: { value: new Vector3() },
    uClipHigh: { value: new Vector3() },
    uClipPlane: { value: new Vector4(0, 0, 0, 1) },
    uCorner: { value: noCorner() },
    uToBox: { value: new Matrix4() },
    uSceneToBox: { value: new Matrix4() },
    uEyeAt: { value: new Vector3() },
    uToEnvironment: { value: new Matrix3() },
    uEye: { value: new Vector4(0, 0, 1, 1) },
    uSceneDepth,
    uEnvironment: nothing(),
    uAliases: nothing(),
    uEnvironmentLight: { value: 1 },
    uLampCount: { value: 0 },
    uLamps: { value: Array.from({ length: LAMPS }, () => new Vector4()) },
    uLampLight: { value: Array.from({ length: LAMPS }, () => new Vector3()) },
    uScatters: { value: MAX_SCATTERS },
    uBeyond: { value: new Vector3() },
    uAnisotropy: { value: 0 },
    uSurface: { value: 0 },
    uShine: { value: 0 },
    uContrast: { value: new Vector4(1, 1, 1, 1) },
    uGloss: { value: GLOSS },
    uOcclusionReach: { value: 1 },
    uMostLight: { value: MAX_LIGHT },
    uSample: { value: 0 },
    uHistory: { value: 0 },
    uToBefore: { value: new Matrix4() },
    uEyeBefore: { value: new Vector3() },
    uMostHistory: { value: mostHistory },
    uTurn: { value: new Vector2(0, 1) },
    uCalm: { value: 0 },
  };
}

/** Returns the matrix from the box's own coordinates, um from its low corner, to the bundle's world, um. */
export function boxToWorld({ matrix, min }: BlockFrame): Matrix4 {
  return new Matrix4().fromArray([...matrix]).multiply(new Matrix4().makeTranslation(...min));
}

/**
 * Sets the uniforms of the block of texels: its texture, its box in um, and where that box lies in
 * the texture.
 */
export function texelsInto(uniforms: TraceUniforms, { frame, texture, index, size }: MediumTexels) {
  uniforms.uVolume.value = texture;
  uniforms.uIndex.value = index;
  uniforms.uTexels.value.set(...size);
  const edges = frame.max.map((v, k) => v - frame.min[k]);
  uniforms.uSize.value.set(edges[0], edges[1], edges[2]);
  uniforms.uVoxel.value = Math.min(...frame.spacing_um);
  const first = frame.size.map((n) => (frame.apron + 0.5) / n);
  const last = frame.size.map((n) => (n - frame.apron - 0.5) / n);
  uniforms.uTexLow.value.set(first[0], last[1], first[2]); // rows run in the direction of -y
  uniforms.uTexPerUm.value.set(
    (last[0] - first[0]) / Math.max(edges[0], 1e-9),
    (first[1] - last[1]) / Math.max(edges[1], 1e-9),
    (last[2] - first[2]) / Math.max(edges[2], 1e-9),
  );
  uniforms.uOcclusionReach.value = OCCLUSION_REACH * Math.max(...edges);
}

/**
 * @param box from um of the box to the scene
 * @param environmentLight mean radiance of the environment
 */
export function sceneInto(
  uniforms: TraceUniforms,
  { clip, bounds }: TraceScene,
  frame: BlockFrame,
  box: Matrix4,
  settings: TraceSettings,
  isDraft: boolean,
  environmentLight: readonly [number, number, number],
): void {
  const toWorld = boxToWorld(frame);
  const toBox = toWorld.clone().invert();
  clipInto(clip, toWorld, toBox, uniforms);
  const turn = new Matrix4().makeRotationY((settings.environmentTurn_deg * Math.PI) / 180);
  uniforms.uToEnvironment.value.copy(turnOf(turn.multiply(box)));
  uniforms.uEnvironmentLight.value = settings.environmentLight;
  uniforms.uMostLight.value = isDraft ? MAX_LIGHT_MOVING : MAX_LIGHT;
  const most = isDraft ? FEW_SCATTERS : MAX_SCATTERS;
  uniforms.uScatters.value = settings.isMultiple ? most : 1;
  const beyond = settings.isMultiple && isDraft ? settings.environmentLight : 0;
  uniforms.uBeyond.value.set(...environmentLight).multiplyScalar(beyond);
  const { steps } = settings;
  uniforms.uStride.value = steps > 0 ? uniforms.uSize.value.length() / Math.max(1, steps) : 0;
  uniforms.uAnisotropy.value = settings.anisotropy;
  uniforms.uSurface.value = settings.surface;
  uniforms.uShine.value = settings.shine;
  lampsInto(uniforms, settings.lamps, bounds, toBox);
}

/** @param toBox from the bundle's world to um of the box */
function lampsInto(
  uniforms: TraceUniforms,
  lamps: TraceSettings["lamps"],
  bounds: Bounds,
  toBox: Matrix4,
): void {
  const edge = Math.max(...bounds.max.map((v, k) => v - bounds.min[k]));
  const middle = new Vector3(...bounds.min).add(new Vector3(...bounds.max)).multiplyScalar(0.5);
  let count = 0;
  for (const { isOn, x, y, z, color, strength } of lamps.slice(0, LAMPS)) {
    if (!isOn || strength <= 0) continue;
    const aside = new Vector3(x, y, z).multiplyScalar(edge);
    const at = aside.clone().add(middle).applyMatrix4(toBox);
    uniforms.uLamps.value[count].set(at.x, at.y, at.z, LAMP_RADIUS * edge);
    // A lamp of strength 1 gives the irradiance pi at the centre, like a white room.
    const intensity = strength * Math.PI * Math.max(aside.lengthSq(), (edge / 4) ** 2);
    uniforms.uLampLight.value[count].set(...color).multiplyScalar(intensity);
    count++;
  }
  uniforms.uLampCount.value = count;
}
