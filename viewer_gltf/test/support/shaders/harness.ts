/** Runs in the page: marches a synthetic volume with COUNT_STEPS and reads the numbers. */
import {
  ClampToEdgeWrapping,
  Data3DTexture,
  LinearFilter,
  PerspectiveCamera,
  RedFormat,
  Scene,
  UnsignedByteType,
  Vector3,
  WebGLRenderer,
  WebGLRenderTarget,
} from "three";
import { cellCounts, cellRanges } from "../../../src/bundle/cell_ranges";
import type { TileVolume } from "../../../src/bundle/generated/volumes";
import type { Size3 } from "../../../src/bundle/ktx2";
import { Cuts } from "../../../src/gpu/clip_planes";
import { Eyes } from "../../../src/gpu/eyes";
import { DepthPass } from "../../../src/render/depth_pass";
import type { Compositing } from "../../../src/state/parameters/volumes";
import { TileMarch } from "../../../src/volumes/tile_raymarch";
import { occupancyDistances } from "../../../src/voxels/empty_space";
import { makeFrame } from "../../../src/voxels/march_frame";
import { brickCounts } from "../../../src/voxels/skip_bricks";
import { opacities } from "../../../src/voxels/transfer_luts";
import type { TransferTable2d } from "../../../src/voxels/transfer_table_2d";
import { makeBricks } from "../fixture/volumes";
import { seeded } from "../seeded";
import { cube, PIXELS } from "./cube";
import { meansOf } from "./mean";
import { sparsePixels } from "./periphery";
import { columnsOverBorder } from "./seam";

export type Run = Readonly<{
  /** Texels along each edge of the cube. */
  side: number;
  /** Opacity of a voxel's length, 0..255, in bricks that are not empty. */
  opacity: number;
  /** Bricks that are not empty: all, none, or every second one along each axis. */
  bricks: "all" | "none" | "checkerboard";
}>;

/** Steps over the pixels that the volume covers. */
export type Counts = Readonly<{ pixels: number; most: number; least: number; covered: number }>;

function texture3D(texels: Uint8Array<ArrayBuffer>, side: number): Data3DTexture {
  const texture = new Data3DTexture(texels, side, side, side);
  texture.format = RedFormat;
  texture.type = UnsignedByteType;
  texture.minFilter = texture.magFilter = LinearFilter;
  texture.wrapS = texture.wrapT = texture.wrapR = ClampToEdgeWrapping;
  texture.unpackAlignment = 1;
  texture.needsUpdate = true;
  return texture;
}

/** The table by which rays skip empty space. */
export type Skips = "bricks" | "cells";

/** @param table 256 RGBA entries */
export function marchOf(
  volume: TileVolume,
  texels: Uint8Array<ArrayBuffer>,
  bricks: Uint8Array,
  table: Uint8Array,
  skips: Skips | null,
  depth: DepthPass,
  table2d: TransferTable2d | null = null,
): TileMarch {
  const [side] = volume.size;
  const frame = makeFrame(depth.texture);
  frame.uEye.value.set(0, 0, PIXELS, PIXELS);
  frame.uPart.value.set(0, 0, PIXELS, PIXELS);
  const march = new TileMarch(volume, 1, frame);
  const cells = [cellRanges(texels, volume.size)];
  const texture = texture3D(texels, side);
  const shown = { channels: ["A"], level: 0, texture, index: null, bricks: [bricks], cells };
  march.setAppearances([{ color: [1, 1, 1], table, table2d, isInDisc: false }]);
  const distances = (ranges: readonly Uint8Array[], count: Size3) =>
    occupancyDistances({ bricks: ranges, alphas: [opacities(table)], count });
  if (skips === "bricks") {
    march.skips.setBricks(distances(shown.bricks, brickCounts(volume.size)));
  } else if (skips === "cells") {
    march.skips.setCells(shown, distances(cells, cellCounts(volume.size)), volume.size);
  }
  march.show(shown, null, 1, 1);
  return march;
}

function makeMarch(
  { side, opacity, bricks }: Run,
  volume: TileVolume,
  depth: DepthPass,
): TileMarch {
  const [count] = brickCounts(volume.size);
  const ranges = new Uint8Array(2 * count ** 3);
  const holds = (x: number, y: number, z: number) =>
    bricks === "all" || (bricks === "checkerboard" && (x + y + z) % 2 === 0);
  for (let i = 0; i < count ** 3; i++) {
    const at = [i % count, Math.floor(i / count) % count, Math.floor(i / count ** 2)] as const;
    ranges.fill(holds(...at) ? 255 : 0, 2 * i, 2 * i + 2);
  }
  const entries = new Uint8Array(1024).fill(255);
  for (let i = 0; i < 256; i++) entries[4 * i + 3] = i === 0 ? 0 : opacity;
  const full = new Uint8Array(side ** 3).fill(255);
  return marchOf(volume, full, ranges, entries, "bricks", depth);
}

/** Draws marches, one over the other, as `camera` sees them. Returns the pixels by row. */
export function draw(
  marches: readonly TileMarch[],
  camera: PerspectiveCamera,
  depth: DepthPass,
  renderer: WebGLRenderer,
): Uint8Array {
  const scene = new Scene();
  for (const march of marches) scene.add(march.mesh);
  camera.updateMatrixWorld();
  renderer.setSize(PIXELS, PIXELS, false);
  const eyes = new Eyes();
  eyes.followScreen(renderer, camera);
  depth.render(renderer, scene, eyes, [...scene.children]);
  const target = new WebGLRenderTarget(PIXELS, PIXELS);
  renderer.setRenderTarget(target);
  renderer.setClearColor(0, 0);
  renderer.clear();
  renderer.render(scene, camera);
  const rgba = new Uint8Array(4 * PIXELS * PIXELS);
  renderer.readRenderTargetPixels(target, 0, 0, PIXELS, PIXELS, rgba);
  target.dispose();
  scene.clear();
  return rgba;
}

/** Returns a camera along the space diagonal of the cube, which is its longest ray. */
export function diagonalCamera(edge: number): PerspectiveCamera {
  const camera = new PerspectiveCamera(10, 1, edge / 10, edge * 40);
  const away = 6 * edge;
  camera.position.set(edge / 2 + away, -edge / 2 + away, edge / 2 + away);
  camera.lookAt(edge / 2, -edge / 2, edge / 2);
  return camera;
}

function countsOf(rgba: Uint8Array): number[] {
  return Array.from({ length: rgba.length / 4 }, (_, i) =>
    rgba[4 * i + 3] === 0 ? 0 : rgba[4 * i] + 256 * rgba[4 * i + 1],
  );
}

function countSteps(run: Run): Counts {
  const renderer = new WebGLRenderer();
  const depth = new DepthPass(new Cuts());
  const march = makeMarch(run, cube(run.side), depth);
  march.mesh.material.defines.COUNT_STEPS = 1;
  const rgba = draw([march], diagonalCamera(run.side - 3), depth, renderer);
  renderer.dispose();
  const counts = countsOf(rgba).filter((count) => count > 0);
  let covered = 1;
  for (let i = 0; i < rgba.length; i += 4) {
    if (rgba[i + 3] > 0) covered = Math.min(covered, rgba[i + 2] / 255);
  }
  return {
    pixels: counts.length,
    most: Math.max(...counts),
    least: Math.min(...counts),
    covered,
  };
}

/** Returns the largest number of steps of a ray through a row of cubes, seen along the row. */
function countThrough(run: Run, cubes: number): number {
  const renderer = new WebGLRenderer();
  const depth = new DepthPass(new Cuts());
  const edge = run.side - 3;
  const camera = new PerspectiveCamera(10, 1, edge / 10, edge * 60);
  camera.position.set(cubes * edge + 8 * edge, -0.3 * edge, 0.9 * edge);
  camera.lookAt(0, -edge / 2, edge / 2);
  const sum = new Array<number>(PIXELS * PIXELS).fill(0);
  for (let i = 0; i < cubes; i++) {
    const march = makeMarch(run, cube(run.side, i * edge), depth);
    march.mesh.material.defines.COUNT_STEPS = 1;
    march.shareWith(new Vector3(0, -edge, 0), new Vector3(cubes * edge, 0, edge), cubes);
    countsOf(draw([march], camera, depth, renderer)).forEach((count, k) => {
      sum[k] += count;
    });
  }
  renderer.dispose();
  return Math.max(...sum);
}

/**
 * Returns blobs of random intensity in a cube, and a random transfer function that shows some
 * intensities.
 */
export function randomScene(seed: number, side: number) {
  const random = seeded(seed);
  const texels = new Uint8Array(side ** 3);
  for (let blob = 0; blob < 6; blob++) {
    const center = [0, 1, 2].map(() => random() * side);
    const radius = 3 + 9 * random();
    const top = 40 + 215 * random();
    for (let i = 0; i < texels.length; i++) {
      const p = [i % side, Math.floor(i / side) % side, Math.floor(i / side ** 2)];
      const off = Math.hypot(...p.map((v, k) => v - center[k]));
      texels[i] = Math.max(texels[i], Math.round(top * Math.max(0, 1 - off / radius)));
    }
  }
  const table = new Uint8Array(1024).fill(255);
  const [low, high] = [10 + 100 * random(), 130 + 120 * random()];
  const opacity = 5 + 250 * random();
  for (let i = 0; i < 256; i++) table[4 * i + 3] = i > low && i < high ? opacity : 0;
  const bricks = makeBricks({ size: [side, side, side], texels }).texels;
  return { texels, table, bricks };
}

/**
 * Returns the largest difference between a random scene drawn with and without skips, and the
 * number of visible pixels.
 */
function compareSkips(seed: number, skips: Skips): Readonly<{ apart: number; drawn: number }> {
  const side = 51; // rays are shorter than the steps, so samples are at whole voxels
  const renderer = new WebGLRenderer();
  const depth = new DepthPass(new Cuts());
  const { texels, table, bricks } = randomScene(seed, side);
  const [skipping, plain] = [skips, null].map((by) =>
    draw(
      [marchOf(cube(side), texels, bricks, table, by, depth)],
      diagonalCamera(side - 3),
      depth,
      renderer,
    ),
  );
  renderer.dispose();
  const drawn = plain.filter((v, i) => i % 4 === 3 && v > 0).length;
  return { apart: Math.max(...plain.map((v, i) => Math.abs(v - skipping[i]))), drawn };
}

/** Intensities of a cube: from 0 to 255 along x, or 255 everywhere. */
export type Filling = "ramp" | "uniform";

/** Returns the mean opacity, 0..1, seen along x through a cube. */
function meanOpacity(filling: Filling, side: number, opacity: number): number {
  return meanAlong("over", filling, side, opacity)[3];
}

/** Returns the mean colour and opacity, 0..1, of a white cube seen along x. */
function meanAlong(
  compositing: Compositing,
  filling: Filling,
  side: number,
  opacity: number,
  window: readonly [number, number] = [0, 1],
  isUnlit = false,
): number[] {
  const renderer = new WebGLRenderer();
  const depth = new DepthPass(new Cuts());
  const edge = side - 3;
  const texels = new Uint8Array(side ** 3);
  for (let i = 0; i < texels.length; i++) {
    const x = Math.min(edge, Math.max(0, (i % side) - 1));
    texels[i] = filling === "ramp" ? Math.round((255 * x) / edge) : 255;
  }
  const table = new Uint8Array(1024).fill(255);
  for (let i = 0; i < 256; i++) table[4 * i + 3] = Math.round((opacity * i) / 255);
  const bricks = makeBricks({ size: [side, side, side], texels }).texels;
  const march = marchOf(cube(side), texels, bricks, table, "bricks", depth);
  march.composite(compositing);
  march.setAppearances([{ color: [1, 1, 1], table, window, isInDisc: false }]);
  if (isUnlit) march.mesh.material.defines.UNLIT = 1;
  const camera = new PerspectiveCamera(0.2, 1, edge, edge * 1000);
  camera.position.set(300 * edge, -edge / 2, edge / 2);
  camera.lookAt(0, -edge / 2, edge / 2);
  const rgba = draw([march], camera, depth, renderer);
  renderer.dispose();
  const sum = [0, 0, 0, 0];
  for (let y = 24; y < 40; y++) {
    for (let x = 24; x < 40; x++) {
      for (let k = 0; k < 4; k++) sum[k] += rgba[4 * (y * PIXELS + x) + k] / 255;
    }
  }
  return sum.map((v) => v / 16 ** 2);
}

/**
 * Returns the mean opacity, 0..1, of a sheet of a few voxels, seen along x through one tile of four
 * in a row. The tile's share of the steps is so small that each is longer than the sheet is thick.
 */
function opacityOfSheet(skips: Skips | null, thickness: number): number {
  const renderer = new WebGLRenderer();
  const depth = new DepthPass(new Cuts());
  const [side, tiles] = [198, 4];
  const edge = side - 3;
  const texels = new Uint8Array(side ** 3);
  for (let i = 0; i < texels.length; i++) {
    const x = i % side;
    if (x >= 101 && x < 101 + thickness) texels[i] = 255;
  }
  const table = new Uint8Array(1024).fill(255);
  for (let i = 0; i < 256; i++) table[4 * i + 3] = i < 128 ? 0 : 8;
  const bricks = makeBricks({ size: [side, side, side], texels }).texels;
  const march = marchOf(cube(side), texels, bricks, table, skips, depth);
  march.shareWith(new Vector3(0, -edge, 0), new Vector3(tiles * edge, 0, edge), tiles);
  const camera = new PerspectiveCamera(0.2, 1, edge, edge * 1000);
  camera.position.set(300 * edge, -edge / 2, edge / 2);
  camera.lookAt(0, -edge / 2, edge / 2);
  const rgba = draw([march], camera, depth, renderer);
  renderer.dispose();
  let sum = 0;
  for (let y = 8; y < 56; y++) {
    for (let x = 8; x < 56; x++) sum += rgba[4 * (y * PIXELS + x) + 3] / 255;
  }
  return sum / 48 ** 2;
}

/** Returns the mean opacity, 0..1, of a full cube that has faded in over an empty one to a share. */
function opacityWhileFading(fresh: number): number {
  const renderer = new WebGLRenderer();
  const depth = new DepthPass(new Cuts());
  const side = 35;
  const packed = (texels: Uint8Array<ArrayBuffer>) => ({
    channels: ["A"],
    level: 0,
    texture: texture3D(texels, side),
    index: null,
    bricks: [makeBricks({ size: [side, side, side], texels }).texels],
    cells: [cellRanges(texels, [side, side, side])],
  });
  const table = new Uint8Array(1024).fill(255);
  for (let i = 0; i < 256; i++) table[4 * i + 3] = Math.round(i / 32);
  const texels = new Uint8Array(side ** 3).fill(255);
  const shown = packed(texels);
  const march = marchOf(cube(side), texels, shown.bricks[0], table, null, depth);
  march.show(shown, packed(new Uint8Array(side ** 3)), fresh, 1);
  const rgba = draw([march], diagonalCamera(side - 3), depth, renderer);
  renderer.dispose();
  return rgba[4 * (32 * PIXELS + 32) + 3] / 255;
}

const harness = {
  countSteps,
  countThrough,
  compareSkips,
  meanOpacity,
  opacityOfSheet,
  opacityWhileFading,
  meanAlong,
  columnsOverBorder,
  meansOf,
  sparsePixels,
};
export type Harness = typeof harness;

Object.assign(window, { harness });
