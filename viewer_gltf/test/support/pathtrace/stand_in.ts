/**
 * Runs in the page: a view during motion, which is marched, and the same view at rest, which is
 * path-traced.
 */
import { Matrix4, PerspectiveCamera, Scene, Vector3, Vector4, WebGLRenderer } from "three";
import type { TileVolume } from "../../../src/bundle/generated/volumes";
import { Cuts } from "../../../src/gpu/clip_planes";
import { noCorner } from "../../../src/gpu/clip_uniforms";
import { Eyes } from "../../../src/gpu/eyes";
import { environmentTables } from "../../../src/pathtrace/environment_sampling";
import type { MediumTexels } from "../../../src/pathtrace/medium_loader";
import { Tracer } from "../../../src/pathtrace/path_tracer";
import { DepthPass } from "../../../src/render/depth_pass";
import { MarchPass } from "../../../src/render/raymarch_pass";
import { START_TRACE, type TraceSettings } from "../../../src/state/path_trace_settings";
import { TileMarch } from "../../../src/volumes/tile_raymarch";
import { tracedTable } from "../../../src/volumes/traced_table";
import { MAX_STEPS, makeFrame } from "../../../src/voxels/march_frame";
import { appearancesOf, type Run, texelsOf } from "./harness";

export type View = Run &
  Readonly<{
    /** The part of the specimen that is kept, um along x. */
    cut?: readonly [number, number];
  }>;

/** Encoded and premultiplied pixels; rows are ordered from the bottom. */
export type Pair = Readonly<{ moving: number[]; resting: number[] }>;

let shared: WebGLRenderer | undefined;

function boxOf(run: View): TileVolume {
  const file = { path: "x", bytes: 0, sha256: "" };
  const edges = run.size.map((n, k) => (n - 3) * run.spacing_um[k]);
  return {
    ...{ tile: "r0_c0", file, bricks: file, size: [...run.size], apron: 1 },
    bounds_um: { min: [0, -edges[1], 0], max: [edges[0], 0, edges[2]] },
    matrix: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1],
    levels: [{ size: [...run.size], offset: 0, length: 1, sha256: "" }],
  };
}

function cameraOf({ camera: { eye, target, fov_deg } }: View): PerspectiveCamera {
  const away = Math.hypot(...eye.map((v, i) => v - target[i]));
  const camera = new PerspectiveCamera(fov_deg, 1, away / 100, away * 100);
  camera.position.set(eye[0], eye[1], eye[2]);
  camera.lookAt(target[0], target[1], target[2]);
  camera.updateMatrixWorld();
  return camera;
}

/** A specimen in front of a camera, drawn like on the page. */
class Shown {
  private readonly renderer: WebGLRenderer;
  private readonly depth = new DepthPass(new Cuts());
  private readonly eyes = new Eyes();
  private readonly texels: MediumTexels;
  private readonly tracer: Tracer;
  private readonly frame = makeFrame(this.depth.texture);
  private readonly march: TileMarch;
  private readonly pass: MarchPass;
  private readonly camera: PerspectiveCamera;
  private readonly scene = new Scene();
  private settings: TraceSettings = START_TRACE;

  constructor(private readonly run: View) {
    shared ??= new WebGLRenderer();
    this.renderer = shared;
    this.renderer.setSize(run.pixels, run.pixels, false);
    this.texels = texelsOf(run);
    this.tracer = new Tracer({ value: this.depth.texture });
    this.tracer.fill(this.texels);
    this.tracer.lightBy(
      environmentTables({ ...run.environment, rgb: Float32Array.from(run.environment.rgb) }),
    );
    this.march = new TileMarch(boxOf(run), this.texels.channels.length, this.frame);
    this.march.show({ ...this.texels, cells: null }, null, 1, 1);
    this.march.clip(this.clip);
    this.scene.add(this.march.mesh);
    this.camera = cameraOf(run);
    this.eyes.followScreen(this.renderer, this.camera);
    this.depth.render(this.renderer, new Scene(), this.eyes, []);
    this.pass = new MarchPass(this.renderer, this.frame);
  }

  private get clip() {
    const [left, right] = this.run.cut ?? [-1e9, 1e9];
    return {
      min: new Vector3(left, -1e9, -1e9),
      max: new Vector3(right, 1e9, 1e9),
      plane: new Vector4(0, 0, 0, 1),
      corner: noCorner(),
    };
  }

  private get given() {
    const bounds = { min: this.texels.frame.min, max: this.texels.frame.max };
    return { specimen: new Matrix4(), clip: this.clip, solids: 0, bounds };
  }

  /** Applies settings, and marches with them. */
  set(changed: Partial<TraceSettings>): void {
    this.settings = { ...START_TRACE, ...changed };
    const { settings, frame, tracer } = this;
    const appearances = appearancesOf(this.run).map((each) => ({
      ...each,
      isInDisc: false,
      table: tracedTable(each.table, settings),
    }));
    tracer.setAppearances(appearances, settings);
    this.march.setAppearances(appearances);
    frame.uDensity.value = settings.density;
    frame.uSteps.value = settings.steps > 0 ? settings.steps : MAX_STEPS;
    tracer.lightMarch(frame, settings, this.camera.matrixWorldInverse);
    this.pass.render(this.scene, this.eyes, 1);
  }

  /** Returns the frame during motion. */
  move(): number[] {
    const { renderer, eyes, given, settings, pass } = this;
    this.tracer.standIn(renderer, eyes, given, settings, pass.marched);
    return this.read();
  }

  /** Returns the frame after `frames` frames at rest, with `passes` samples per pixel each. */
  rest(frames: number, passes: number): number[] {
    const { renderer, eyes, given, settings, pass } = this;
    const gathering = { scale: 1, passes, mayTremble: false, isDraft: false };
    for (let i = 0; i < frames; i++) {
      this.tracer.render(renderer, eyes, given, settings, { ...gathering, standIn: pass.marched });
    }
    return this.read();
  }

  private read(): number[] {
    const { pixels } = this.run;
    const bytes = new Uint8Array(4 * pixels ** 2);
    this.renderer.readRenderTargetPixels(this.tracer.picture, 0, 0, pixels, pixels, bytes);
    return [...bytes];
  }

  dispose(): void {
    for (const each of [this.tracer, this.march, this.pass]) each.dispose();
  }
}

function pair(run: View): Pair {
  const shown = new Shown(run);
  shown.set(run.settings);
  const moving = shown.move();
  const resting = shown.rest(run.passes, 1);
  shown.dispose();
  return { moving, resting };
}

/** Returns a frame at rest, the frames after a change of its settings, and the frame at rest after those. */
function change(
  run: View,
  changed: Partial<TraceSettings>,
): Readonly<{ before: number[]; frames: number[][]; after: number[] }> {
  const shown = new Shown(run);
  shown.set(run.settings);
  const before = shown.rest(run.passes, 1);
  shown.set(changed);
  const frames = [shown.move(), ...Array.from({ length: 24 }, () => shown.rest(1, 0.25))];
  const after = shown.rest(run.passes, 1);
  shown.dispose();
  return { before, frames, after };
}

const harness = { pair, change };
export type Harness = typeof harness;

Object.assign(window, { harness });
