/**
 * Finds the object that a ray hits, on the CPU. The ray is tested against the boxes of all shown objects. From the
 * nearest box on, it is then tested against the triangles of each object that may contain a nearer hit. The ray passes
 * through hidden objects and through parts that are cut away. If a gap shrinks the objects, a ray that is enlarged
 * by the same factor is tested against each original object: see gap.ts.
 */
import { type BufferAttribute, type InterleavedBufferAttribute, Matrix4, Vector3 } from "three";
import { type Clip, isKept } from "../math/clip";
import { along, type Ray } from "../math/vec3";
import type { ShownSurface } from "../state/on_screen";
import { GONE } from "./flags";
import { grownFrom } from "./gap";
import { ROW } from "./object_material";

/** `distance` is in lengths of the ray's direction. */
export type ObjectHit = Readonly<{ row: number; distance: number; tile: string }>;

type Attribute = BufferAttribute | InterleavedBufferAttribute;
/** For each row, the range of its triangles in the index buffer: the first index, and the one after the last. */
type Ranges = ReadonlyMap<number, readonly [number, number]>;

const made = new WeakMap<object, Ranges>();

/** Returns the ranges of a mesh's index buffer, in which the triangles of one object follow one another. */
function rangesOf(index: BufferAttribute, rows: Attribute): Ranges {
  const found = made.get(index);
  if (found !== undefined) return found;
  const ranges = new Map<number, readonly [number, number]>();
  let start = 0;
  for (let i = 3; i <= index.count; i += 3) {
    const row = rows.getX(index.getX(start));
    if (i < index.count && rows.getX(index.getX(i)) === row) continue;
    ranges.set(row, [start, i]);
    start = i;
  }
  made.set(index, ranges);
  return ranges;
}

/** Returns where a ray enters the box of a row's object, in lengths of its direction; false if it misses the box. */
function entry(boxes: Float32Array, row: number, { origin, direction }: Ray): number | false {
  let [from, to] = [0, Number.POSITIVE_INFINITY];
  for (let k = 0; k < 3; k++) {
    const [low, high] = [boxes[6 * row + k], boxes[6 * row + 3 + k]];
    if (direction[k] === 0) {
      if (origin[k] < low || origin[k] > high) return false;
      continue;
    }
    const a = (low - origin[k]) / direction[k];
    const b = (high - origin[k]) / direction[k];
    from = Math.max(from, Math.min(a, b));
    to = Math.min(to, Math.max(a, b));
    if (from > to) return false;
  }
  return from;
}

const toMesh = new Matrix4();
const [start, way] = [new Vector3(), new Vector3()];
const [a, ab, ac, n, off] = Array.from({ length: 5 }, () => new Vector3());

/**
 * Returns the nearest hit of a ray, or null if it hits no shown object.
 *
 * @param ray in um, in the specimen's space
 * @param world matrix from the specimen's space to the scene
 * @param surfaces meshes of one channel that are on screen
 * @param boxes six values for each row, in um: the smallest x, y, z and the largest
 * @param gap_um gap between the objects: see gap.ts
 * @param flags one for each row: see flags.ts
 */
export function pickObject(
  ray: Ray,
  world: Matrix4,
  surfaces: readonly ShownSurface[],
  boxes: Float32Array,
  gap_um: number,
  flags: Uint8Array,
  clip: Clip,
): ObjectHit | null {
  const near: [row: number, from: number][] = [];
  for (let row = 0; row < flags.length; row++) {
    if (flags[row] === GONE) continue;
    const from = entry(boxes, row, ray); // the shrunk box that is drawn lies within this box
    if (from !== false) near.push([row, from]);
  }
  near.sort((one, other) => one[1] - other[1]);
  let best: ObjectHit | null = null;
  for (const [row, from] of near) {
    if (best !== null && from > best.distance) break;
    const { origin, direction } = gap_um > 0 ? grownFrom(ray, boxes, row, gap_um) : ray;
    for (const { mesh, tile } of surfaces) {
      const { index, attributes } = mesh.geometry;
      if (index === null || attributes[ROW] === undefined) continue;
      const range = rangesOf(index, attributes[ROW] as Attribute).get(row);
      if (range === undefined) continue;
      toMesh.copy(mesh.matrixWorld).invert().multiply(world);
      start.fromArray(origin).applyMatrix4(toMesh);
      way
        .fromArray(along(origin, direction, 1))
        .applyMatrix4(toMesh)
        .sub(start);
      const limit = best?.distance ?? Number.POSITIVE_INFINITY;
      const isThere = (t: number) => isKept(along(ray.origin, ray.direction, t), clip);
      const distance = nearest(index, attributes.position as Attribute, range, limit, isThere);
      if (distance !== null) best = { row, distance, tile };
    }
  }
  return best;
}

/**
 * Returns the distance of the nearest triangle that the ray `start` + t `way` hits from either side, in lengths of
 * `way`. Null: it hits none before `limit`. Method of Möller and Trumbore (1997), doi:10.1080/10867651.1997.10487468.
 */
function nearest(
  index: BufferAttribute,
  position: Attribute,
  [from, to]: readonly [number, number],
  limit: number,
  isThere: (distance: number) => boolean,
): number | null {
  let best: number | null = null;
  for (let i = from; i < to; i += 3) {
    a.fromBufferAttribute(position, index.getX(i));
    ab.fromBufferAttribute(position, index.getX(i + 1)).sub(a);
    ac.fromBufferAttribute(position, index.getX(i + 2)).sub(a);
    n.crossVectors(way, ac);
    const det = ab.dot(n);
    if (det === 0) continue;
    off.subVectors(start, a);
    const u = off.dot(n) / det;
    if (u < 0 || u > 1) continue;
    off.cross(ab);
    const v = way.dot(off) / det;
    if (v < 0 || u + v > 1) continue;
    const t = ac.dot(off) / det;
    if (t > 0 && t < (best ?? limit) && isThere(t)) best = t;
  }
  return best;
}
