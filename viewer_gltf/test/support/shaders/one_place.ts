/** Two surfaces in one place, with coordinates that were quantized separately: which of them is visible. */
import {
  DepthTexture,
  DirectionalLight,
  DoubleSide,
  Matrix4,
  Mesh,
  MeshStandardMaterial,
  PerspectiveCamera,
  PlaneGeometry,
  Scene,
  SphereGeometry,
  Vector2,
  Vector3,
  WebGLRenderer,
  WebGLRenderTarget,
} from "three";
import { BothEyes } from "../../../src/gpu/both_eyes";
import { Cuts } from "../../../src/gpu/clip_planes";
import { marchedUniforms } from "../../../src/gpu/composite_pass";
import type { Vec3 } from "../../../src/math/vec3";
import { BlendedSurface, makeSurfaceFrame } from "../../../src/render/blend_material";
import { seeded } from "../seeded";

const PIXELS = 64;
const APART_M = 4e-5; // half a step of 14 bits of 1.2 m

/** Returns the shared uniforms of surfaces without any volume. */
function makeFrame(target: WebGLRenderTarget, cuts: Cuts) {
  const disc = {
    uDisc: { value: new Vector2(3, 2) },
    uApex: { value: new Vector3() },
    uAxis: { value: new Vector3(0, 0, -1) },
    uIsCrossing: { value: false },
    uRim: { value: 1 },
  };
  const depth = { value: new DepthTexture(1, 1) };
  const picture = marchedUniforms(target.texture.clone(), depth);
  return makeSurfaceFrame(disc, picture, cuts, new BothEyes());
}

function makeCamera(position: Vec3): PerspectiveCamera {
  const camera = new PerspectiveCamera(30, 1, 0.01, 20);
  camera.position.set(...position);
  camera.lookAt(0, 0, 0);
  camera.layers.enableAll();
  return camera;
}

/** Returns the pixels of a scene, row by row. */
function draw(
  renderer: WebGLRenderer,
  target: WebGLRenderTarget,
  scene: Scene,
  camera: PerspectiveCamera,
): Uint8Array {
  renderer.setRenderTarget(target);
  renderer.render(scene, camera);
  const rgba = new Uint8Array(4 * PIXELS * PIXELS);
  renderer.readRenderTargetPixels(target, 0, 0, PIXELS, PIXELS, rgba);
  return rgba;
}

/**
 * Counts pixels of the first channel, which is red, and of the second, blue, in a view that both
 * fill, from each eye.
 *
 * @param eyes places of the eyes, m
 */
function shownOfTwo(
  opacity: number,
  eyes: readonly Vec3[],
): readonly (readonly [number, number])[] {
  const renderer = new WebGLRenderer({ antialias: false });
  const target = new WebGLRenderTarget(PIXELS, PIXELS);
  const frame = makeFrame(target, new Cuts());
  const scene = new Scene();
  const random = seeded(7);
  [0xff0000, 0x0000ff].forEach((emissive, rank) => {
    const geometry = new PlaneGeometry(4, 4, 30 + 3 * rank, 30);
    const { position } = geometry.attributes;
    for (let i = 0; i < position.count; i++) position.setZ(i, APART_M * (2 * random() - 1));
    const material = new MeshStandardMaterial({ color: 0, emissive });
    const mesh = new Mesh(geometry, material);
    scene.add(mesh);
    const surface = new BlendedSurface(mesh, [material], frame);
    surface.set({ opacity, taken: 0, isInDisc: false, isCrossing: false, rank });
  });
  const shown = eyes.map((eye) => {
    const rgba = draw(renderer, target, scene, makeCamera(eye));
    const count = (k: number) => rgba.filter((v, i) => i % 4 === k && v > 20).length;
    return [count(0), count(2)] as const;
  });
  renderer.dispose();
  renderer.forceContextLoss();
  return shown;
}

/**
 * Returns the least and most light, 0..255, on the inside of a half sphere that ends at z = 0. It
 * opens towards the eye, at the face of a tile in front of it.
 *
 * @param isVolume whether the tile is drawn as a volume, which is empty there
 */
function insideOfHalf(isVolume: boolean): readonly [number, number] {
  const renderer = new WebGLRenderer({ antialias: false });
  const target = new WebGLRenderTarget(PIXELS, PIXELS);
  const cuts = new Cuts();
  cuts.open(isVolume ? { min: [-1, -1, 0], max: [1, 1, 1] } : null, new Matrix4());
  const scene = new Scene();
  const lamp = new DirectionalLight(0xffffff, 3);
  lamp.position.set(1, 1, 1.5);
  const half = new SphereGeometry(0.5, 64, 32, 0, Math.PI).rotateY(Math.PI);
  const material = new MeshStandardMaterial({ side: DoubleSide, roughness: 1 });
  const mesh = new Mesh(half, material);
  scene.add(lamp, mesh);
  const surface = new BlendedSurface(mesh, [material], makeFrame(target, cuts));
  surface.set({ opacity: 1, taken: 0, isInDisc: false, isCrossing: false, rank: 0 });
  const rgba = draw(renderer, target, scene, makeCamera([0.3, 0.2, 2]));
  renderer.dispose();
  renderer.forceContextLoss();
  const inside: number[] = [];
  const [low, high] = [0.4 * PIXELS, 0.6 * PIXELS];
  for (let y = Math.ceil(low); y < high; y++) {
    for (let x = Math.ceil(low); x < high; x++) inside.push(rgba[4 * (y * PIXELS + x)]);
  }
  return [Math.min(...inside), Math.max(...inside)];
}

const harness = { shownOfTwo, insideOfHalf };
export type Harness = typeof harness;
Object.assign(window, { harness });
