/**
 * The light that reaches each cell of a coarse grid: from the surroundings (ambient occlusion
 * within a radius) and from a lamp (shadows). Plain arrays.
 *
 * The surroundings use local ambient occlusion (Hernell, Ljung & Ynnerman 2010) with the same
 * weights as the meshes: a hit counts less if it is farther away. The lamp's light is computed
 * plane by plane, like half-angle slicing (Kniss et al. 2003): each plane across the lamp's
 * direction receives the light that the previous plane transmits.
 */
import type { Size3 } from "../../bundle/ktx2";
import type { Vec3 } from "../../math/vec3";

/**
 * Weights of 26 directions on a sphere, along axes, edges and corners: the Lebedev rule of degree
 * 7.
 */
const WEIGHTS = [0, 1 / 21, 4 / 105, 9 / 280] as const;
/**
 * Share of the surroundings that a point one cell in front of a flat wall sees; it counts as fully
 * open.
 */
const OPEN = 0.72;

/**
 * Returns the share of the surroundings, 0 to 1, that is seen from each cell; 1 in front of a flat
 * wall.
 *
 * @param through share of light that passes each cell, x fastest
 * @param radius in cells
 */
export function openness(through: Float32Array, size: Size3, radius: number): Float32Array {
  const [nx, ny, nz] = size;
  const pad = Math.ceil(radius);
  const row = nx + 2 * pad;
  const plane = row * (ny + 2 * pad);
  // A transparent border saves all tests for the end of the grid. There is one array for each
  // length of a step.
  const padded = [1, Math.SQRT2, Math.sqrt(3)].map((length) => {
    const cells = new Float32Array(plane * (nz + 2 * pad)).fill(1);
    for (let z = 0, from = 0; z < nz; z++) {
      for (let y = 0; y < ny; y++, from += nx) {
        const to = (z + pad) * plane + (y + pad) * row + pad;
        copyRow(cells, to, through, from, nx, length);
      }
    }
    return cells;
  });
  const isDimmed = dimmedWithin(through, size, Math.floor(radius));
  const seen = new Float32Array(through.length);
  for (let dz = -1; dz <= 1; dz++) {
    for (let dy = -1; dy <= 1; dy++) {
      for (let dx = -1; dx <= 1; dx++) {
        const kind = dx * dx + dy * dy + dz * dz;
        if (kind === 0) continue;
        const length = Math.sqrt(kind);
        const cells = padded[kind - 1];
        const step = dz * plane + dy * row + dx;
        // a hit counts by the nearness of the cell's front
        const near = Float32Array.from({ length: Math.floor(radius / length) }, (_, k) =>
          Math.max(0, 1 - ((k + 0.5) * length) / radius),
        );
        for (let z = 0, to = 0; z < nz; z++) {
          for (let y = 0; y < ny; y++, to += nx) {
            const at = (z + pad) * plane + (y + pad) * row + pad;
            addRow(seen, to, nx, isDimmed, cells, at, step, near, WEIGHTS[kind]);
          }
        }
      }
    }
  }
  for (let i = 0; i < seen.length; i++) seen[i] = Math.min(1, seen[i] / OPEN);
  return seen;
}

/** The share of light that passes each cell of a row along a step of this length, in cell edges. */
function copyRow(
  cells: Float32Array,
  to: number,
  through: Float32Array,
  from: number,
  count: number,
  length: number,
): void {
  for (let x = 0; x < count; x++) {
    const clear = through[from + x];
    cells[to + x] = clear === 1 ? 1 : clear ** length; // most cells are clear, and powers are slow
  }
}

/** Adds the light that the cells of a row receive from one direction. */
function addRow(
  seen: Float32Array,
  to: number,
  count: number,
  isDimmed: Uint8Array,
  cells: Float32Array,
  at: number,
  step: number,
  near: Float32Array,
  weight: number,
): void {
  for (let x = 0; x < count; x++) {
    let left = 1;
    let hidden = 0;
    if (isDimmed[to + x] === 1) {
      for (let k = 0, there = at + x + step; k < near.length; k++, there += step) {
        const clear = cells[there];
        hidden += near[k] * left * (1 - clear);
        left *= clear;
      }
    }
    seen[to + x] += weight * (1 - hidden);
  }
}

/** Marks the cells (1) that have a cell within `reach` along each axis that takes light. Other cells are not occluded. */
function dimmedWithin(through: Float32Array, size: Size3, reach: number): Uint8Array {
  let found = new Uint8Array(through.length);
  for (let i = 0; i < found.length; i++) found[i] = through[i] === 1 ? 0 : 1;
  let stride = 1;
  for (const count of size) {
    const spread = new Uint8Array(found.length);
    for (let from = 0; from < found.length; from++) {
      if (found[from] === 0) continue;
      const at = Math.floor(from / stride) % count;
      const last = Math.min(count - 1, at + reach);
      for (let k = Math.max(0, at - reach); k <= last; k++) spread[from + (k - at) * stride] = 1;
    }
    found = spread;
    stride *= count;
  }
  return found;
}

/**
 * Returns the share of a distant lamp's light, 0 to 1, that reaches the middle of each cell.
 *
 * @param towards unit direction to the lamp
 */
export function lampLight(through: Float32Array, size: Size3, towards: Vec3): Float32Array {
  const strides = [1, size[0], size[0] * size[1]] as const;
  const along = [0, 1, 2].reduce((a, b) => (Math.abs(towards[b]) > Math.abs(towards[a]) ? b : a));
  const [p, q] = [0, 1, 2].filter((axis) => axis !== along);
  const [np, nq, planes] = [size[p], size[q], size[along]];
  const forward = towards[along] > 0; // if true, the last plane is the nearest one to the lamp
  // where the way to the lamp crosses the previous plane, in cells to the side
  const length = 1 / Math.abs(towards[along]);
  const [aside, up] = [towards[p] * length, towards[q] * length];
  const [di, dj] = [Math.floor(aside), Math.floor(up)];
  const [fi, fj] = [aside - di, up - dj];
  const lit = new Float32Array(through.length);
  // Light that leaves the cells of the previous plane.
  let before = new Float32Array(np * nq).fill(1);
  let leaving = new Float32Array(np * nq);
  const at = (i: number, j: number) =>
    i < 0 || j < 0 || i >= np || j >= nq ? 1 : before[j * np + i];
  for (let k = 0; k < planes; k++) {
    const start = (forward ? planes - 1 - k : k) * strides[along];
    for (let j = 0; j < nq; j++) {
      for (let i = 0; i < np; i++) {
        const [a, b] = [i + di, j + dj];
        const low = (1 - fi) * at(a, b) + fi * at(a + 1, b);
        const high = (1 - fi) * at(a, b + 1) + fi * at(a + 1, b + 1);
        const coming = (1 - fj) * low + fj * high;
        const cell = start + i * strides[p] + j * strides[q];
        const clear = through[cell];
        const half = clear === 1 ? 1 : clear ** (length / 2);
        lit[cell] = coming * half;
        leaving[j * np + i] = coming * half * half;
      }
    }
    [before, leaving] = [leaving, before];
  }
  return lit;
}

/** Interleaves openness and lamp light as bytes, 0 to 255. */
export function asTexels(open: Float32Array, lit: Float32Array): Uint8Array<ArrayBuffer> {
  const texels = new Uint8Array(2 * open.length);
  for (let i = 0; i < open.length; i++) {
    texels[2 * i] = Math.round(255 * open[i]);
    texels[2 * i + 1] = Math.round(255 * lit[i]);
  }
  return texels;
}
