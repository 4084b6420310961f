/** Runs in the page: marches a synthetic volume with COUNT_STEPS and reads the numbers back. */
import {
  ClampToEdgeWrapping,
  Data3DTexture,
  LinearFilter,
  PerspectiveCamera,
  RedFormat,
  Scene,
  UnsignedByteType,
  WebGLRenderer,
  WebGLRenderTarget,
} from "three";
import type { TileVolume } from "../../src/bundle/generated/volumes";
import { Cuts } from "../../src/view/cuts";
import { DepthPass } from "../../src/view/depth_pass";
import { Eyes } from "../../src/view/eyes";
import { brickCounts } from "../../src/volume/brick_counts";
import { opacities } from "../../src/volume/luts";
import { occupancyDistances } from "../../src/volume/occupancy";
import { makeFrame, TileMarch, wholeSpecimen } from "../../src/volume/tile_march";

export type Run = Readonly<{
  /** Texels along each edge of the cube. */
  side: number;
  /** Opacity of a voxel's length, of 255, where there is anything. */
  opacity: number;
  /** Which bricks hold anything: all, none, or every second one along each axis. */
  bricks: "all" | "none" | "checkerboard";
}>;

/** Over the pixels that the volume covers. */
export type Counts = Readonly<{ pixels: number; most: number; least: number; covered: number }>;

const PIXELS = 64;

function makeMarch({ side, opacity, bricks }: Run, depth: DepthPass): TileMarch {
  const file = { path: "x", bytes: 0, sha256: "" };
  const edge = side - 3; // lattice intervals without the apron, one um each
  const volume: TileVolume = {
    tile: "r0_c0",
    file,
    bricks: file,
    size: [side, side, side],
    apron: 1,
    bounds_um: { min: [0, -edge, 0], max: [edge, 0, edge] },
    matrix: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1],
    levels: [{ size: [side, side, side], offset: 0, length: 1 }],
  };
  const [count] = brickCounts(volume.size);
  const ranges = new Uint8Array(2 * count ** 3);
  const holds = (x: number, y: number, z: number) =>
    bricks === "all" || (bricks === "checkerboard" && (x + y + z) % 2 === 0);
  for (let i = 0; i < count ** 3; i++) {
    const at = [i % count, Math.floor(i / count) % count, Math.floor(i / count ** 2)] as const;
    ranges.fill(holds(...at) ? 255 : 0, 2 * i, 2 * i + 2);
  }
  const texture = new Data3DTexture(new Uint8Array(side ** 3).fill(255), side, side, side);
  texture.format = RedFormat;
  texture.type = UnsignedByteType;
  texture.minFilter = texture.magFilter = LinearFilter;
  texture.wrapS = texture.wrapT = texture.wrapR = ClampToEdgeWrapping;
  texture.unpackAlignment = 1;
  texture.needsUpdate = true;

  const entries = new Uint8Array(1024).fill(255);
  for (let i = 0; i < 256; i++) entries[4 * i + 3] = i === 0 ? 0 : opacity;
  const march = new TileMarch(volume, 1, makeFrame(depth.texture));
  march.clip(wholeSpecimen());
  march.show({ channels: ["A"], level: 0, texture, bricks: [ranges] }, null, 1, 1);
  march.dress([{ color: [1, 1, 1], table: entries, isInDisc: false }]);
  march.leapBy(
    occupancyDistances({
      bricks: [ranges],
      alphas: [opacities(entries)],
      count: brickCounts(volume.size),
    }),
  );
  march.mesh.material.defines.COUNT_STEPS = 1;
  return march;
}

/** Look along the cube's space diagonal, its longest ray, and count. */
function countSteps(run: Run): Counts {
  const renderer = new WebGLRenderer();
  const depth = new DepthPass(new Cuts());
  const march = makeMarch(run, depth);
  const scene = new Scene();
  scene.add(march.mesh);
  const edge = run.side - 3;
  const camera = new PerspectiveCamera(10, 1, edge / 10, edge * 40);
  const away = 6 * edge;
  camera.position.set(edge / 2 + away, -edge / 2 + away, edge / 2 + away);
  camera.lookAt(edge / 2, -edge / 2, edge / 2);
  camera.updateMatrixWorld();
  renderer.setSize(PIXELS, PIXELS, false);
  const eyes = new Eyes();
  eyes.followScreen(renderer, camera);
  depth.render(renderer, scene, eyes, [march.mesh]);
  const target = new WebGLRenderTarget(PIXELS, PIXELS);
  renderer.setRenderTarget(target);
  renderer.setClearColor(0, 0);
  renderer.clear();
  renderer.render(scene, camera);
  const rgba = new Uint8Array(4 * PIXELS * PIXELS);
  renderer.readRenderTargetPixels(target, 0, 0, PIXELS, PIXELS, rgba);
  renderer.dispose();
  const counts: number[] = [];
  let covered = 1;
  for (let i = 0; i < rgba.length; i += 4) {
    if (rgba[i + 3] === 0) continue;
    counts.push(rgba[i] + 256 * rgba[i + 1]);
    covered = Math.min(covered, rgba[i + 2] / 255);
  }
  return {
    pixels: counts.length,
    most: Math.max(...counts),
    least: Math.min(...counts),
    covered,
  };
}

declare global {
  interface Window {
    countSteps?: typeof countSteps;
  }
}
window.countSteps = countSteps;
