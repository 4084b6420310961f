import { type BufferGeometry, Matrix4, SphereGeometry, Vector3 } from "three";
import { mergeGeometries } from "three/examples/jsm/utils/BufferGeometryUtils.js";
import { describe, expect, it } from "vitest";
import type { Box } from "../math/box";
import type { Vec3 } from "../math/vec3";
import { type Face, faceTowards, hideRemnants } from "./thin_remnants";

/** Two adjacent tiles, um; the left one is drawn as a volume. */
const LEFT: Box = { min: [0, 0, 0], max: [10, 10, 8] };
const RIGHT: Box = { min: [10, 0, 0], max: [20, 10, 8] };

/** Half of an ellipsoid in the right tile, um, that begins at `x`. */
function cap(x: number, depth: number, length: number, y = 5): BufferGeometry {
  const half = new SphereGeometry(0.5, 24, 16, Math.PI / 2, Math.PI); // the half with x >= 0
  return half.scale(2 * depth, length, length).translate(x, y, 4);
}

function faceOf(tile: Box, other: Box): Face {
  const face = faceTowards(tile, other);
  if (face === null) throw new Error("the tiles are not neighbours");
  return face;
}

/** The first corner of each drawn triangle, um. */
function drawnTriangles(geometry: BufferGeometry): readonly Vec3[] {
  const { drawRange, index } = geometry;
  const end = Math.min(drawRange.count, index?.count ?? 0);
  return Array.from({ length: end / 3 }, (_, i) =>
    new Vector3()
      .fromBufferAttribute(geometry.attributes.position, index?.getX(3 * i) ?? 0)
      .toArray(),
  );
}

function trianglesAfter(geometry: BufferGeometry, face: Face | null = faceOf(RIGHT, LEFT)): number {
  hideRemnants(geometry, new Matrix4(), face);
  return drawnTriangles(geometry).length;
}

describe("beside an open tile", () => {
  it("a flat remnant that touches the face is not drawn, and is drawn again later", () => {
    const remnant = cap(10, 0.5, 4);
    const all = (remnant.index?.count ?? 0) / 3;
    expect(trianglesAfter(remnant)).toBe(0);
    expect(trianglesAfter(remnant, null)).toBe(all);
  });

  it("a needle along the end of the data that begins at the face is not drawn", () => {
    expect(trianglesAfter(cap(10, 1.5, 0.4, 0.2))).toBe(0);
  });

  it.each([
    ["is a branch that leaves the face", cap(10, 2, 0.5)],
    ["is as deep as it is long", cap(10, 0.9, 1.8)],
    ["reaches far into the tile", cap(10, 1.6, 6)],
    ["doesn't touch the face", cap(10.1, 0.5, 4)],
    ["is a layer along the face", cap(10, 0.5, 7)],
  ])("a component stays if it %s", (_, component) => {
    const all = (component.index?.count ?? 0) / 3;
    expect(trianglesAfter(component)).toBe(all);
  });

  it("only the remnant is removed from a mesh of several components", () => {
    const [remnant, other] = [cap(10, 0.4, 3, 2), cap(10, 3, 5, 6.5)];
    const both = mergeGeometries([remnant, other]);
    const kept = drawnTriangles(other).length;
    expect(trianglesAfter(both)).toBe(kept);
    expect(drawnTriangles(both).every(([, y]) => y > 3.9)).toBe(true);
  });

  it("a component stays whole even if its parts have separate vertices where they meet", () => {
    const [flat, deep] = [cap(10, 0.5, 4), cap(10, 2, 4)]; // two caps that share one rim
    const both = mergeGeometries([flat, deep]);
    const all = (both.index?.count ?? 0) / 3;
    expect(trianglesAfter(both)).toBe(all);
  });

  it("a mesh is measured in world coordinates", () => {
    const metres = cap(10, 0.5, 4).scale(1e-6, 1e-6, 1e-6);
    hideRemnants(metres, new Matrix4().makeScale(1e6, 1e6, 1e6), faceOf(RIGHT, LEFT));
    expect(drawnTriangles(metres)).toEqual([]);
  });
});

describe("the face of a tile towards another one", () => {
  it("is the face that both share", () => {
    expect(faceTowards(RIGHT, LEFT)).toMatchObject({ axis: 0, isUpper: false });
    expect(faceTowards(LEFT, RIGHT)).toMatchObject({ axis: 0, isUpper: true });
  });

  it.each<[string, Box]>([
    ["only shares an edge", { min: [10, 10, 0], max: [20, 20, 8] }],
    ["is separate", { min: [12, 0, 0], max: [20, 10, 8] }],
    ["is the tile itself", LEFT],
  ])("is null if the other tile %s", (_, other) => {
    expect(faceTowards(LEFT, other)).toBeNull();
  });
});
