/** Runs in the page: traces synthetic media and returns the gathered light, as numbers. */
import {
  Data3DTexture,
  FloatType,
  Matrix4,
  NearestFilter,
  PerspectiveCamera,
  RGBAFormat,
  RGBAIntegerFormat,
  Scene,
  Vector3,
  Vector4,
  WebGLRenderer,
} from "three";
import { STREAM_BRICK } from "../../../src/bundle/generated/constants";
import { Cuts } from "../../../src/gpu/clip_planes";
import { noCorner } from "../../../src/gpu/clip_uniforms";
import { Eyes } from "../../../src/gpu/eyes";
import { floatTarget, floatTexture } from "../../../src/gpu/float_targets";
import { drawEyes } from "../../../src/gpu/offscreen_target";
import { ScreenPass } from "../../../src/gpu/screen_pass";
import { brickRanges } from "../../../src/pathtrace/assemble_tiles";
import { environmentTables } from "../../../src/pathtrace/environment_sampling";
import { viewOf } from "../../../src/pathtrace/eye_rays";
import type { MediumTexels } from "../../../src/pathtrace/medium_loader";
import { Tracer } from "../../../src/pathtrace/path_tracer";
import { TRACE_WARP } from "../../../src/pathtrace/shaders/sources";
import { DepthPass } from "../../../src/render/depth_pass";
import { START_TRACE, type TraceSettings } from "../../../src/state/path_trace_settings";
import { STORED } from "../../../src/voxels/bricks/tree";
import { alikeRows } from "../../../src/voxels/transfer_table_2d";
import { volumeTexture } from "../../../src/voxels/volume_texture";

export type Run = Readonly<{
  /** Texels along x, y, z including the apron; one byte each, x fastest. */
  size: readonly [number, number, number];
  texels: readonly number[];
  spacing_um: readonly [number, number, number];
  /** Opacities 0..255 of the 256 intensities, and the linear colour of the channel. */
  opacities: readonly number[];
  color: readonly [number, number, number];
  settings: Partial<TraceSettings>;
  environment: Readonly<{ width: number; height: number; rgb: readonly number[] }>;
  camera: Readonly<{ eye: readonly number[]; target: readonly number[]; fov_deg: number }>;
  pixels: number;
  passes: number;
  brick?: number;
  /** Standard error of the luminance below which tiles are finished. */
  calm?: number;
  /**
   * Offsets of the eye from `camera.eye`, um, frame by frame, repeated. The path tracer may reuse
   * samples then.
   */
  asides?: readonly (readonly number[])[];
  /** Samples per pixel in a frame; below 1, only a share of the pixels gets one. */
  share?: number;
  /** Form of the same medium: as several equal channels, as a 2D transfer function, or in bricks. */
  channels?: 1 | 2 | 4;
  isTwoD?: boolean;
  isBricked?: boolean;
  /** Whether the medium is drawn as during a motion. */
  isDraft?: boolean;
  /** Number of equal parts of the passes that are reported separately. */
  batches?: number;
}>;

/** Results of a run. Pixels are ordered row by row, from the bottom. */
export type Gathered = Readonly<{
  /** For each pixel, sums over its samples: r, g, b and coverage. */
  sums: number[];
  /** For each pixel, further sums: squared luminance, number of samples, distance and openness. */
  moments: number[];
  picture: number[];
  /** For each batch, the mean over the frame of what its passes added to the sums. */
  batches: number[][];
  /** Samples per pixel, as the tracer reports them. */
  samples: number;
}>;

export function texelsOf(run: Run): MediumTexels {
  const count = run.channels ?? 1;
  const texels = Uint8Array.from(run.texels);
  const many = Uint8Array.from(run.texels.flatMap((v) => new Array<number>(count).fill(v)));
  const { texture, index } = run.isBricked
    ? inBricks(run.size, texels)
    : { texture: volumeTexture(many, [...run.size], count), index: null };
  const edges = run.size.map((n, k) => (n - 3) * run.spacing_um[k]);
  const ranges = brickRanges({ size: [...run.size], stride: 1, texels }, 0);
  return {
    channels: Array.from({ length: count }, (_, c) => `${c}`),
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
    index,
    release: () => texture.dispose(),
    bricks: new Array<typeof ranges>(count).fill(ranges),
  };
}

/**
 * Returns all bricks of STREAM_BRICK^3 texels of a volume with their aprons, in reverse order, and
 * their index.
 */
function inBricks(size: Run["size"], texels: Uint8Array) {
  const cells = size.map((n) => Math.ceil(n / STREAM_BRICK));
  const [cx, cy, cz] = cells;
  const sides = cells.map((n) => STORED * n);
  const atlas = new Uint8Array(sides[0] * sides[1] * sides[2]);
  const entries = new Uint8Array(4 * cx * cy * cz);
  for (let cell = 0; cell < cx * cy * cz; cell++) {
    const at = [cell % cx, Math.floor(cell / cx) % cy, Math.floor(cell / (cx * cy))];
    const slot = at.map((v, k) => cells[k] - 1 - v);
    entries.set(slot, 4 * cell);
    for (let i = 0; i < STORED ** 3; i++) {
      const inside = [i % STORED, Math.floor(i / STORED) % STORED, Math.floor(i / STORED ** 2)];
      const [x, y, z] = inside.map((v, k) =>
        Math.min(size[k] - 1, Math.max(0, STREAM_BRICK * at[k] + v - 1)),
      );
      const [ax, ay, az] = inside.map((v, k) => STORED * slot[k] + v);
      atlas[(az * sides[1] + ay) * sides[0] + ax] = texels[(z * size[1] + y) * size[0] + x];
    }
  }
  const index = new Data3DTexture(entries, cx, cy, cz);
  index.format = RGBAIntegerFormat;
  index.internalFormat = "RGBA8UI";
  index.minFilter = index.magFilter = NearestFilter;
  index.needsUpdate = true;
  return { texture: volumeTexture(atlas, [sides[0], sides[1], sides[2]], 1), index };
}

/** Equal channels share the opacity. */
export function appearancesOf(run: Run) {
  const count = run.channels ?? 1;
  const table = new Uint8Array(1024).fill(255);
  run.opacities.forEach((opacity, i) => {
    table[4 * i + 3] = Math.round(255 * (1 - (1 - opacity / 255) ** (1 / count)));
  });
  const table2d = run.isTwoD
    ? { cells: alikeRows(table), gradientMax: 0.5, envelope: table }
    : null;
  return Array.from({ length: count }, () => ({ color: run.color, table, table2d }));
}

// one renderer for all runs, whose tracers are not disposed, so that later runs reuse compiled
// shaders
let shared: WebGLRenderer | undefined;

function gather(run: Run): Gathered {
  shared ??= new WebGLRenderer();
  const renderer = shared;
  renderer.setSize(run.pixels, run.pixels, false);
  const depth = new DepthPass(new Cuts());
  const scene = new Scene();
  const tracer = new Tracer({ value: depth.texture }, run.brick, run.calm ?? 0);
  const texels = texelsOf(run);
  const settings = {
    ...START_TRACE,
    lamps: START_TRACE.lamps.map((lamp) => ({ ...lamp, isOn: false })),
    ...run.settings,
  };
  const bounds = { min: texels.frame.min, max: texels.frame.max };
  tracer.fill(texels);
  tracer.setAppearances(appearancesOf(run), settings);
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
    corner: noCorner(),
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
    const mayTremble = run.asides !== undefined;
    const isDraft = run.isDraft === true;
    const gathering = { scale: 1, passes: run.share ?? 1, mayTremble, isDraft };
    tracer.render(renderer, eyes, given, settings, gathering);
    if (run.batches !== undefined && (i + 1) % (run.passes / run.batches) === 0) endBatch();
  }
  const found = {
    sums: [...read(0)],
    moments: [...read(1)],
    picture: pictureOf(renderer, tracer, run),
    batches,
    samples: tracer.samples,
  };
  return found;
}

export type Warp = Readonly<{
  pixels: number;
  fov_deg: number;
  /** Places of the eye before and after, um; it looks along -z. */
  from: readonly [number, number, number];
  to: readonly [number, number, number];
  /** For each pixel of the old view: distance, um (0: nothing), and r, g, b, coverage. */
  away_um: readonly number[];
  colors: readonly number[];
  size_um: readonly [number, number, number];
}>;

/** Returns an image seen from another place: r, g, b, coverage of each pixel. */
function warp(run: Warp): number[] {
  const { pixels: n } = run;
  const renderer = new WebGLRenderer();
  renderer.setSize(n, n, false);
  const [began, now] = [run.from, run.to].map((at) => {
    const camera = new PerspectiveCamera(run.fov_deg, 1, 1, 1000);
    camera.position.set(...at);
    camera.updateMatrixWorld();
    return { camera, view: viewOf(camera, new Matrix4()) };
  });
  const edge = Math.max(...run.size_um);
  const guides = run.away_um.flatMap((um) => [um / edge, 0, 0, 0]);
  const texture = (numbers: readonly number[]) =>
    floatTexture(n, n, RGBAFormat, Float32Array.from(numbers));
  const pass = new ScreenPass(TRACE_WARP, {
    uColor: { value: texture(run.colors) },
    uGuide: { value: texture(guides) },
    uEdge: { value: edge },
    uAway: { value: now.view.eye.distanceTo(new Vector3(...run.size_um).multiplyScalar(0.5)) },
    uToBox: { value: now.view.toBox },
    uEyeAt: { value: now.view.eye },
    uFromBox: { value: began.view.fromBox },
    uEyeThere: { value: began.view.eye },
  });
  const target = floatTarget(1, FloatType);
  const eyes = new Eyes();
  eyes.followScreen(renderer, now.camera);
  drawEyes(renderer, pass.scene, eyes, target, 1, (_, part) => {
    pass.uPart.value.copy(part);
  });
  const found = new Float32Array(4 * n ** 2);
  renderer.readRenderTargetPixels(target, 0, 0, n, n, found);
  for (const each of [pass, target, renderer]) each.dispose();
  return [...found];
}

function pictureOf(renderer: WebGLRenderer, tracer: Tracer, { pixels }: Run): number[] {
  const bytes = new Uint8Array(4 * pixels ** 2);
  renderer.readRenderTargetPixels(tracer.picture, 0, 0, pixels, pixels, bytes);
  return [...bytes];
}

const harness = { gather, warp };
export type Harness = typeof harness;

Object.assign(window, { harness });
