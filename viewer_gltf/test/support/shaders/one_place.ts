/** Two surfaces in one place, but for coordinates that were quantized apart: which of them shows. */
import {
  DepthTexture,
  Mesh,
  MeshStandardMaterial,
  PerspectiveCamera,
  PlaneGeometry,
  Scene,
  Vector2,
  Vector3,
  WebGLRenderer,
  WebGLRenderTarget,
} from "three";
import { BothEyes } from "../../../src/gpu/both_eyes";
import { Cuts } from "../../../src/gpu/clip_planes";
import { marchedUniforms } from "../../../src/gpu/composite_pass";
import { BlendedSurface, makeSurfaceFrame } from "../../../src/surfaces/blend_material";
import { seeded } from "../seeded";

const PIXELS = 64;
const APART_M = 4e-5; // half a step of 14 bits of 1.2 m

/** Pixels of the first channel, which is red, and of the second, blue, of a picture that both fill. */
function shownOfTwo(opacity: number): readonly [number, number] {
  const renderer = new WebGLRenderer({ antialias: false });
  const target = new WebGLRenderTarget(PIXELS, PIXELS);
  const camera = new PerspectiveCamera(30, 1, 0.01, 20);
  camera.position.set(0.9, 0.4, 1.6);
  camera.lookAt(0, 0, 0);
  camera.layers.enableAll();
  const disc = {
    uDisc: { value: new Vector2(3, 2) },
    uApex: { value: new Vector3() },
    uAxis: { value: new Vector3(0, 0, -1) },
    uIsCrossing: { value: false },
    uRim: { value: 1 },
  };
  const depth = { value: new DepthTexture(1, 1) };
  const picture = marchedUniforms(target.texture.clone(), depth);
  const frame = makeSurfaceFrame(disc, picture, new Cuts(), new BothEyes());
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
  renderer.setRenderTarget(target);
  renderer.render(scene, camera);
  const rgba = new Uint8Array(4 * PIXELS * PIXELS);
  renderer.readRenderTargetPixels(target, 0, 0, PIXELS, PIXELS, rgba);
  const count = (k: number) => rgba.filter((v, i) => i % 4 === k && v > 20).length;
  renderer.dispose();
  renderer.forceContextLoss();
  return [count(0), count(2)];
}

const harness = { shownOfTwo };
export type Harness = typeof harness;
Object.assign(window, { harness });
