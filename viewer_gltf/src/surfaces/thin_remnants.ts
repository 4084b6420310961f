/**
 * Finds thin remnants of objects beside an open tile, which are not drawn while the tile is open.
 *
 * If one tile is drawn as a volume, its neighbours are still drawn as surfaces. An object that extends
 * slightly past the shared face leaves a flat remnant in the neighbour, which looks like an opaque lens
 * beside the translucent volume. An object that is cut by the end of the data leaves a sliver there,
 * which sticks out like a needle.
 */
import { Box3, type BufferGeometry, type Matrix4, Vector3 } from "three";
import type { Box } from "../math/box";
import { AXES } from "../math/vec3";

/** A remnant lies within this share of its tile's edge from one of the tile's faces. */
const DEEPEST = 3 / 20;
/** A remnant extends at most this share of its own length from that face. */
const FLATTEST = 1 / 3;
/**
 * A flat component longer than this share of the tile's shortest edge is a layer, which is drawn.
 */
const LONGEST = 1 / 2;
/**
 * Share of the tile's edge within which a vertex counts as lying in a face; coordinates have at
 * least 14 bits.
 */
const TOUCHING = 1 / 1000;

type Axis = (typeof AXES)[number];

/** The face of a tile behind which the open tile lies. */
export type Face = Readonly<{ axis: Axis; isUpper: boolean; tile: Box }>;

/** The face of a tile that it shares with another one; null if they are not neighbours. */
export function faceTowards(tile: Box, other: Box): Face | null {
  const overlap = (axis: Axis) =>
    Math.min(tile.max[axis], other.max[axis]) - Math.max(tile.min[axis], other.min[axis]);
  const slack = (axis: Axis) => TOUCHING * (tile.max[axis] - tile.min[axis]);
  const meeting = AXES.filter((axis) => overlap(axis) <= slack(axis));
  if (meeting.length !== 1 || overlap(meeting[0]) < -slack(meeting[0])) return null;
  const [axis] = meeting;
  return { axis, isUpper: other.max[axis] > tile.max[axis], tile };
}

/**
 * Removes the thin remnants at a face from a mesh, or draws all triangles again.
 *
 * The triangles of the remnants are moved to the end of the index, where they are not drawn.
 *
 * @param toWorld from the mesh's coordinates to um, world
 * @param face null: all triangles are drawn
 */
export function hideRemnants(geometry: BufferGeometry, toWorld: Matrix4, face: Face | null): void {
  geometry.setDrawRange(0, Number.POSITIVE_INFINITY);
  const { index } = geometry;
  if (face === null || index === null) return;
  const isRemnant = remnantVertices(geometry, toWorld, face);
  if (isRemnant === null) return;
  const corners = index.array;
  const [drawn, left]: [number[], number[]] = [[], []];
  for (let i = 0; i < corners.length; i += 3) {
    (isRemnant(corners[i]) ? left : drawn).push(corners[i], corners[i + 1], corners[i + 2]);
  }
  index.array.set([...drawn, ...left]);
  index.needsUpdate = true;
  geometry.setDrawRange(0, drawn.length);
}

/** Whether each vertex belongs to a thin remnant; null if there is none. */
function remnantVertices(
  geometry: BufferGeometry,
  toWorld: Matrix4,
  face: Face,
): ((vertex: number) => boolean) | null {
  const places = placesOf(geometry, toWorld);
  if (!touches(new Box3().setFromArray(places), face)) return null;
  const roots = components(places, geometry.index?.array ?? [], face.tile);
  const extents = new Map<number, Box3>();
  const place = new Vector3();
  for (const [vertex, root] of roots.entries()) {
    const extent = extents.get(root) ?? new Box3();
    extents.set(root, extent.expandByPoint(place.fromArray(places, 3 * vertex)));
  }
  const remnants = new Set<number>();
  for (const [root, extent] of extents) if (isRemnant(extent, face)) remnants.add(root);
  return remnants.size === 0 ? null : (vertex) => remnants.has(roots[vertex]);
}

/** The positions of the vertices, x y z each, um, world. */
function placesOf(geometry: BufferGeometry, toWorld: Matrix4): Float32Array {
  const { position } = geometry.attributes;
  const places = new Float32Array(3 * position.count);
  const place = new Vector3();
  for (let vertex = 0; vertex < position.count; vertex++) {
    place
      .fromBufferAttribute(position, vertex)
      .applyMatrix4(toWorld)
      .toArray(places, 3 * vertex);
  }
  return places;
}

/**
 * For each vertex, one vertex of its connected component. Vertices in one place near a face of the
 * tile count as connected.
 */
function components(places: Float32Array, corners: ArrayLike<number>, tile: Box): Int32Array {
  const parents = Int32Array.from({ length: places.length / 3 }, (_, vertex) => vertex);
  const rootOf = (vertex: number) => {
    let root = vertex;
    while (parents[root] !== root) {
      parents[root] = parents[parents[root]];
      root = parents[root];
    }
    return root;
  };
  const connect = (a: number, b: number) => {
    parents[rootOf(a)] = rootOf(b);
  };
  const first = new Map<string, number>();
  for (let vertex = 0; vertex < parents.length; vertex++) {
    const place = places.subarray(3 * vertex, 3 * vertex + 3);
    if (!isNearFaces(place, tile)) continue; // a component that reaches this far is not a remnant
    const name = place.join();
    connect(vertex, first.get(name) ?? vertex);
    first.set(name, vertex);
  }
  for (let i = 0; i < corners.length; i += 3) {
    connect(corners[i], corners[i + 1]);
    connect(corners[i], corners[i + 2]);
  }
  return parents.map((_, vertex) => rootOf(vertex));
}

function isNearFaces(place: ArrayLike<number>, { min, max }: Box): boolean {
  return AXES.some((axis) => {
    const depth = Math.min(place[axis] - min[axis], max[axis] - place[axis]);
    return depth <= DEEPEST * (max[axis] - min[axis]);
  });
}

function isRemnant(extent: Box3, face: Face): boolean {
  const size = extent.getSize(new Vector3());
  const length = Math.max(...size);
  const edges = AXES.map((axis) => face.tile.max[axis] - face.tile.min[axis]);
  if (!touches(extent, face) || length > LONGEST * Math.min(...edges)) return false;
  const [min, max] = [extent.min.toArray(), extent.max.toArray()];
  return AXES.some((axis) => {
    const depth = Math.min(max[axis] - face.tile.min[axis], face.tile.max[axis] - min[axis]);
    return depth <= DEEPEST * edges[axis] && depth <= FLATTEST * length;
  });
}

function touches(box: Box3, { axis, isUpper, tile }: Face): boolean {
  const near = TOUCHING * (tile.max[axis] - tile.min[axis]);
  return isUpper
    ? box.max.getComponent(axis) >= tile.max[axis] - near
    : box.min.getComponent(axis) <= tile.min[axis] + near;
}
