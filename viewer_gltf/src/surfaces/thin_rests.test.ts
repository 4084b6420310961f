import { type BufferGeometry, Matrix4, SphereGeometry, Vector3 } from "three";
import { mergeGeometries } from "three/examples/jsm/utils/BufferGeometryUtils.js";
import { describe, expect, it } from "vitest";
import type { Box } from "../math/box";
import type { Vec3 } from "../math/vec3";
import { type Face, faceTowards, leaveRestsOut } from "./thin_rests";

/** Two tiles side by side, um; the left one is drawn as a volume. */
const LEFT: Box = { min: [0, 0, 0], max: [10, 10, 8] };
const RIGHT: Box = { min: [10, 0, 0], max: [20, 10, 8] };

/** A half of an ellipsoid of the right tile, um, that begins at `x`. */
function cap(x: number, depth: number, length: number, y = 5): BufferGeometry {
  const half = new SphereGeometry(0.5, 24, 16, Math.PI / 2, Math.PI); // where x >= 0
  return half.scale(2 * depth, length, length).translate(x, y, 4);
}

function faceOf(tile: Box, other: Box): Face {
  const face = faceTowards(tile, other);
  if (face === null) throw new Error("the tiles are no neighbours");
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
  leaveRestsOut(geometry, new Matrix4(), face);
  return drawnTriangles(geometry).length;
}

describe("beside an open tile", () => {
  it("a flat rest that touches the face is left out, and comes back", () => {
    const rest = cap(10, 0.5, 4);
    const all = (rest.index?.count ?? 0) / 3;
    expect(trianglesAfter(rest)).toBe(0);
    expect(trianglesAfter(rest, null)).toBe(all);
  });

  it("a needle along the end of the data that begins at the face is left out", () => {
    expect(trianglesAfter(cap(10, 1.5, 0.4, 0.2))).toBe(0);
  });

  it.each([
    ["is a branch that leaves the face", cap(10, 2, 0.5)],
    ["is as deep as it is long", cap(10, 0.9, 1.8)],
    ["reaches far into the tile", cap(10, 1.6, 6)],
    ["doesn't touch the face", cap(10.1, 0.5, 4)],
    ["is a layer along the face", cap(10, 0.5, 7)],
  ])("a component stays that %s", (_, component) => {
    const all = (component.index?.count ?? 0) / 3;
    expect(trianglesAfter(component)).toBe(all);
  });

  it("only the rest is left out of a mesh of several components", () => {
    const [rest, other] = [cap(10, 0.4, 3, 2), cap(10, 3, 5, 6.5)];
    const both = mergeGeometries([rest, other]);
    const kept = drawnTriangles(other).length;
    expect(trianglesAfter(both)).toBe(kept);
    expect(drawnTriangles(both).every(([, y]) => y > 3.9)).toBe(true);
  });

  it("a component stays whole whose parts have vertices of their own where they meet", () => {
    const [flat, deep] = [cap(10, 0.5, 4), cap(10, 2, 4)]; // one rim
    const both = mergeGeometries([flat, deep]);
    const all = (both.index?.count ?? 0) / 3;
    expect(trianglesAfter(both)).toBe(all);
  });

  it("a mesh counts in the coordinates of the world", () => {
    const metres = cap(10, 0.5, 4).scale(1e-6, 1e-6, 1e-6);
    leaveRestsOut(metres, new Matrix4().makeScale(1e6, 1e6, 1e6), faceOf(RIGHT, LEFT));
    expect(drawnTriangles(metres)).toEqual([]);
  });
});

describe("the face of a tile towards another one", () => {
  it("is the one that both share", () => {
    expect(faceTowards(RIGHT, LEFT)).toMatchObject({ axis: 0, isUpper: false });
    expect(faceTowards(LEFT, RIGHT)).toMatchObject({ axis: 0, isUpper: true });
  });

  it.each<[string, Box]>([
    ["shares an edge alone", { min: [10, 10, 0], max: [20, 20, 8] }],
    ["lies apart", { min: [12, 0, 0], max: [20, 10, 8] }],
    ["is the tile itself", LEFT],
  ])("is none where the other one %s", (_, other) => {
    expect(faceTowards(LEFT, other)).toBeNull();
  });
});
