/** Runs in the page: marches synthetic volumes with two-dimensional transfer functions. */
import { PerspectiveCamera, WebGLRenderer } from "three";
import type { Range } from "../../../src/bundle/transfer_2d";
import { Cuts } from "../../../src/gpu/clip_planes";
import { DepthPass } from "../../../src/render/depth_pass";
import { makeShape } from "../../../src/state/transfer_shapes";
import {
  alikeRows,
  type TransferTable2d,
  transferTable2d,
} from "../../../src/voxels/transfer_table_2d";
import { makeBricks } from "../fixture/volumes";
import { seeded } from "../seeded";
import { cube, PIXELS } from "./cube";
import { diagonalCamera, draw, marchOf, randomScene } from "./harness";

const SIDE = 51;
const EDGE = SIDE - 3;
/** Place and length of the slope between 0 and 255, voxels. */
const SLOPE = { from: 20, length: 8 };

/** Returns the table of one shape with hard edges. */
function oneTable2d(values: Range, gradients: Range, opacity: number): TransferTable2d {
  const shape = { ...makeShape("rectangle", { value: 0.5, gradient: 0.5 }), values, gradients };
  return transferTable2d(
    [{ ...shape, softness: 0, opacity }],
    { gradient_max: 0.5, functions: {} },
    [0, 1],
    1,
  );
}

/**
 * Returns the opacity, 0..1, of a slope between two uniform halves, seen from the side, in PIXELS
 * columns.
 *
 * @param opacity opacity of a voxel's length
 */
function showSlope(values: Range, gradients: Range, opacity: number): number[] {
  const renderer = new WebGLRenderer();
  const depth = new DepthPass(new Cuts());
  const texels = new Uint8Array(SIDE ** 3);
  for (let i = 0; i < texels.length; i++) {
    const x = ((i % SIDE) - 1 - SLOPE.from) / SLOPE.length;
    texels[i] = Math.round(255 * Math.min(1, Math.max(0, x)));
  }
  const bricks = makeBricks({ size: [SIDE, SIDE, SIDE], texels }).texels;
  const table2d = oneTable2d(values, gradients, opacity);
  const march = marchOf(cube(SIDE), texels, bricks, table2d.envelope, "bricks", depth, table2d);
  const away = 300;
  const fov_deg = (2 * Math.atan(0.5 / away) * 180) / Math.PI;
  const camera = new PerspectiveCamera(fov_deg, 1, EDGE, EDGE * 1000);
  camera.position.set(EDGE / 2, -EDGE / 2, (away + 0.5) * EDGE);
  camera.lookAt(EDGE / 2, -EDGE / 2, EDGE / 2);
  const rgba = draw([march], camera, depth, renderer);
  renderer.dispose();
  const row = PIXELS / 2;
  return Array.from({ length: PIXELS }, (_, x) => rgba[4 * (row * PIXELS + x) + 3] / 255);
}

export type Apart = Readonly<{ apart: number; drawn: number }>;

function compare(one: Uint8Array, other: Uint8Array): Apart {
  const drawn = one.filter((v, i) => i % 4 === 3 && v > 0).length;
  return { apart: Math.max(...one.map((v, i) => Math.abs(v - other[i]))), drawn };
}

/** Compares a one-dimensional function with the same function as a two-dimensional table. */
function compareAlike(seed: number): Apart {
  const renderer = new WebGLRenderer();
  const depth = new DepthPass(new Cuts());
  const { texels, table, bricks } = randomScene(seed, SIDE);
  const alike = { cells: alikeRows(table), gradientMax: 0.3, envelope: table };
  const [flat, table2d] = [null, alike].map((each) =>
    draw(
      [marchOf(cube(SIDE), texels, bricks, table, "bricks", depth, each)],
      diagonalCamera(EDGE),
      depth,
      renderer,
    ),
  );
  renderer.dispose();
  return compare(flat, table2d);
}

/** Compares random shapes drawn with and without skips. */
function compareSkips2d(seed: number): Apart {
  const renderer = new WebGLRenderer();
  const depth = new DepthPass(new Cuts());
  const { texels, bricks } = randomScene(seed, SIDE);
  const random = seeded(seed + 1000);
  const shapes = Array.from({ length: 1 + Math.floor(3 * random()) }, (_, i) => ({
    ...makeShape(i % 2 ? "rectangle" : "triangle", { value: random(), gradient: random() }),
    opacity: random(),
  }));
  const table2d = transferTable2d(shapes, { gradient_max: 0.2, functions: {} }, [0, 1], 1);
  const [skipping, plain] = (["cells", null] as const).map((skips) =>
    draw(
      [marchOf(cube(SIDE), texels, bricks, table2d.envelope, skips, depth, table2d)],
      diagonalCamera(EDGE),
      depth,
      renderer,
    ),
  );
  renderer.dispose();
  return compare(plain, skipping);
}

const harness = { showSlope, compareAlike, compareSkips2d };
export type Harness2d = typeof harness;

Object.assign(window, { harness });
