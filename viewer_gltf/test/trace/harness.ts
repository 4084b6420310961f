/** Runs in the page: traces synthetic media and hands back what was gathered, as numbers. */
import {
  ClampToEdgeWrapping,
  Data3DTexture,
  LinearFilter,
  Matrix4,
  PerspectiveCamera,
  RedFormat,
  Scene,
  Vector3,
  Vector4,
  WebGLRenderer,
} from "three";
import { brickRanges } from "../../src/trace/assemble";
import { environmentTables } from "../../src/trace/environment";
import type { MediumTexels } from "../../src/trace/medium";
import { START_TRACE, type TraceSettings } from "../../src/trace/settings";
import { Tracer } from "../../src/trace/tracer";
import { Cuts } from "../../src/view/cuts";
import { DepthPass } from "../../src/view/depth_pass";
import { Eyes } from "../../src/view/eyes";

export type Run = Readonly<{
  /** Texels along x, y, z, apron and all; one byte each, x fastest. */
  size: readonly [number, number, number];
  texels: readonly number[];
  spacing_um: readonly [number, number, number];
  /** Of intensity 0..255: 256 opacities, 0..255; the channel's linear colour. */
  opacities: readonly number[];
  color: readonly [number, number, number];
  settings: Partial<TraceSettings>;
  environment: Readonly<{ width: number; height: number; rgb: readonly number[] }>;
  camera: Readonly<{ eye: readonly number[]; target: readonly number[]; fov_deg: number }>;
  pixels: number;
  passes: number;
  brick?: number;
  /** Standard error of the luminance at which tiles rest. */
  calm?: number;
  /** Where the eye is aside of `camera.eye`, um, frame by frame, over and over. */
  asides?: readonly (readonly number[])[];
  /** Samples of every pixel in a frame: below 1, of so many pixels. */
  share?: number;
  /** So many equal parts of the passes are told of one by one. */
  batches?: number;
}>;

/** Rows from below. */
export type Gathered = Readonly<{
  /** r, g, b and coverage. */
  sums: number[];
  /** Squared luminance, samples, distance and openness, summed. */
  moments: number[];
  picture: number[];
  /** Of each batch: what its passes added to the sums, in the mean of the picture. */
  batches: number[][];
  /** What the tracer says of itself. */
  samples: number;
}>;

function texelsOf(run: Run): MediumTexels {
  const texels = Uint8Array.from(run.texels);
  const texture = new Data3DTexture(texels, ...run.size);
  texture.format = RedFormat;
  texture.minFilter = texture.magFilter = LinearFilter;
  texture.wrapS = texture.wrapT = texture.wrapR = ClampToEdgeWrapping;
  texture.unpackAlignment = 1;
  texture.needsUpdate = true;
  const edges = run.size.map((n, k) => (n - 3) * run.spacing_um[k]);
  return {
    channels: ["A"],
    frame: {
      min: [0, -edges[1], 0],
      max: [edges[0], 0, edges[2]],
      spacing_um: [...run.spacing_um],
      matrix: new Matrix4().toArray(),
      size: [...run.size],
      apron: 1,
      places: new Map(),
    },
    level: 0,
    size: [...run.size],
    texture,
    index: null,
    release: () => texture.dispose(),
    bricks: [brickRanges({ size: [...run.size], stride: 1, texels }, 0)],
  };
}

function gather(run: Run): Gathered {
  const renderer = new WebGLRenderer();
  renderer.setSize(run.pixels, run.pixels, false);
  const depth = new DepthPass(new Cuts());
  const scene = new Scene();
  const tracer = new Tracer({ value: depth.texture }, run.brick, run.calm ?? 0);
  const texels = texelsOf(run);
  const table = new Uint8Array(1024).fill(255);
  run.opacities.forEach((opacity, i) => {
    table[4 * i + 3] = opacity;
  });
  const settings = {
    ...START_TRACE,
    lamps: START_TRACE.lamps.map((lamp) => ({ ...lamp, isOn: false })),
    ...run.settings,
  };
  const bounds = { min: texels.frame.min, max: texels.frame.max };
  tracer.fill(texels);
  tracer.dress([{ color: run.color, table }], settings);
  tracer.lightBy(
    environmentTables({ ...run.environment, rgb: Float32Array.from(run.environment.rgb) }),
  );
  const [ex, ey, ez] = run.camera.eye;
  const longest = Math.hypot(...run.camera.eye.map((v, i) => v - run.camera.target[i]));
  const camera = new PerspectiveCamera(run.camera.fov_deg, 1, longest / 100, longest * 100);
  camera.position.set(ex, ey, ez);
  const [tx, ty, tz] = run.camera.target;
  camera.lookAt(tx, ty, tz);
  const clip = {
    min: new Vector3().setScalar(-1e9),
    max: new Vector3().setScalar(1e9),
    plane: new Vector4(0, 0, 0, 1),
  };
  const eyes = new Eyes();
  const read = (index: number) => {
    const numbers = new Float32Array(4 * run.pixels ** 2);
    const { gathered } = tracer;
    const { pixels: n } = run;
    renderer.readRenderTargetPixels(gathered, 0, 0, n, n, numbers, undefined, index);
    return numbers;
  };
  const batches: number[][] = [];
  let before = [0, 0, 0, 0];
  const endBatch = () => {
    const sums = read(0);
    const now = [0, 0, 0, 0];
    sums.forEach((v, i) => {
      now[i % 4] += v / run.pixels ** 2;
    });
    batches.push(now.map((v, k) => v - before[k]));
    before = now;
  };
  for (let i = 0; i < run.passes; i++) {
    const aside = run.asides?.[i % run.asides.length] ?? [0, 0, 0];
    camera.position.set(ex + aside[0], ey + aside[1], ez + aside[2]);
    camera.updateMatrixWorld();
    eyes.followScreen(renderer, camera);
    if (i === 0) depth.render(renderer, scene, eyes, []);
    const given = { specimen: new Matrix4(), clip, solids: 0, bounds };
    tracer.render(renderer, eyes, given, settings, 1, run.share ?? 1);
    if (run.batches !== undefined && (i + 1) % (run.passes / run.batches) === 0) endBatch();
  }
  const found = {
    sums: [...read(0)],
    moments: [...read(1)],
    picture: pictureOf(renderer, tracer, run),
    batches,
    samples: tracer.samples,
  };
  tracer.dispose();
  renderer.dispose();
  return found;
}

function pictureOf(renderer: WebGLRenderer, tracer: Tracer, { pixels }: Run): number[] {
  const bytes = new Uint8Array(4 * pixels ** 2);
  renderer.readRenderTargetPixels(tracer.picture, 0, 0, pixels, pixels, bytes);
  return [...bytes];
}

const harness = { gather };
export type Harness = typeof harness;

declare global {
  interface Window {
    trace?: Harness;
  }
}
window.trace = harness;
