import {
  BufferAttribute,
  BufferGeometry,
  ExtrudeGeometry,
  Group,
  Matrix4,
  Mesh,
  Shape,
  SphereGeometry,
  Vector2,
} from "three";
import { describe, expect, it } from "vitest";
import { BOXES, CELLS, WALL, WIDTH_UM } from "../../test/support/concave_cells";
import { WHOLE } from "../math/clip";
import type { Ray } from "../math/vec3";
import { ROW } from "./object_material";
import { pickObject } from "./pick";

/** Three balls of radius 1 along z, at 0, 4 and 8, as one mesh that is rotated, moved and scaled. */
function balls() {
  const ball = new SphereGeometry(1, 24, 16);
  const { position } = ball.attributes;
  const index = ball.index as BufferAttribute;
  const points: number[] = [];
  const rows: number[] = [];
  const indices: number[] = [];
  for (let row = 0; row < 3; row++) {
    for (const i of index.array) indices.push(i + points.length / 3);
    for (let i = 0; i < position.count; i++) {
      points.push(position.getX(i), position.getY(i), position.getZ(i) + 4 * row);
      rows.push(row);
    }
  }
  // in the mesh's own space x, y, z are z, x, y, ten times as large, and it is moved
  const own = new Matrix4().makeBasis(...axes()).scale({ x: 0.1, y: 0.1, z: 0.1 } as never);
  own.setPosition(5, 6, 7);
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(new Float32Array(points), 3));
  geometry.applyMatrix4(own.clone().invert());
  geometry.setAttribute(ROW, new BufferAttribute(new Float32Array(rows), 1));
  geometry.setIndex(indices);
  const mesh = new Mesh(geometry);
  mesh.applyMatrix4(own);
  const world = new Group(); // um, which stands in a room
  world.position.set(1, 2, 3);
  world.rotation.set(0.3, 0.2, 0.1);
  world.scale.setScalar(0.01);
  world.add(mesh);
  world.updateMatrixWorld(true);
  const boxes = Float32Array.from([0, 4, 8].flatMap((z) => [-1, -1, z - 1, 1, 1, z + 1]));
  return { mesh, world: world.matrixWorld, boxes };
}

function axes() {
  const turned = new Matrix4().set(0, 1, 0, 0, 0, 0, 1, 0, 1, 0, 0, 0, 0, 0, 0, 1);
  const parts = [new Mesh().position, new Mesh().position, new Mesh().position] as const;
  turned.extractBasis(...parts);
  return parts;
}

const ALONG: Ray = { origin: [0.1, 0.1, -10], direction: [0, 0, 2] };
const ALL = Uint8Array.of(1, 1, 1);

describe("a ray among objects", () => {
  const { mesh, world, boxes } = balls();
  const surfaces = [{ mesh, tile: "r0_c0", channel: "cells" }];
  const pick = (ray: Ray, flags = ALL, clip = WHOLE, gap_um = 0) =>
    pickObject(ray, world, surfaces, boxes, gap_um, flags, clip);

  it("hits the nearest object at its surface, with the distance in lengths of its direction", () => {
    const hit = pick(ALONG);
    expect(hit?.row).toBe(0);
    expect(hit?.tile).toBe("r0_c0");
    expect(hit?.distance).toBeCloseTo((10 - Math.sqrt(1 - 0.02)) / 2, 1);
    expect(pick({ origin: [0.1, 0.1, 20], direction: [0, 0, -1] })?.row).toBe(2);
  });

  it("goes through hidden objects", () => {
    expect(pick(ALONG, Uint8Array.of(0, 1, 1))?.row).toBe(1);
    expect(pick(ALONG, Uint8Array.of(0, 0, 0))).toBeNull();
  });

  it("goes through parts that are cut away, and hits the inside of an object that is cut open", () => {
    const plane = (z: number) => ({
      ...WHOLE,
      plane: { normal: [0, 0, -1] as const, offset_um: -z },
    });
    expect(pick(ALONG, ALL, plane(2))?.row).toBe(1);
    const open = pick(ALONG, ALL, plane(4)); // the ray hits its back half from inside
    expect(open?.row).toBe(1);
    expect(open?.distance).toBeCloseTo((14 + Math.sqrt(1 - 0.02)) / 2, 1);
  });

  it("hits nothing in the corner of a box, beside the object itself", () => {
    expect(pick({ origin: [0.95, 0.95, -10], direction: [0, 0, 1] })).toBeNull();
    expect(pick({ origin: [5, 0, -10], direction: [0, 0, 1] })).toBeNull();
  });

  it("hits an object where it is drawn, shrunk by the gap", () => {
    const gapped = (ray: Ray, clip = WHOLE) => pick(ray, ALL, clip, 0.8); // the balls are drawn with radius 0.6
    const hit = gapped(ALONG);
    expect(hit?.row).toBe(0);
    expect(hit?.distance).toBeCloseTo((10 - Math.sqrt(0.36 - 0.02)) / 2, 1);
    const beside: Ray = { origin: [0.7, 0, -10], direction: [0, 0, 1] };
    expect(pick(beside)?.row).toBe(0);
    expect(gapped(beside)).toBeNull();
    // this cut passes in front of the drawn object, through its place without a gap
    const plane = { normal: [0, 0, -1] as const, offset_um: 0.7 };
    expect(gapped(ALONG, { ...WHOLE, plane })?.distance).toBeCloseTo(hit?.distance ?? 0, 9);
    expect(pick(ALONG, ALL, WHOLE, 99)?.row).toBe(0); // a fifth of its size is left
  });

  it("hits the object in which it begins", () => {
    expect(pick({ origin: [0, 0, 4], direction: [1, 0, 0] })?.row).toBe(1);
  });
});

describe("a ray among cells that touch at a concave corner", () => {
  const meshes = CELLS.map((outline, row) => {
    const shape = new Shape(outline.map(([x, y]) => new Vector2(x, y)));
    const geometry = new ExtrudeGeometry(shape, { depth: WIDTH_UM, bevelEnabled: false });
    const { count } = geometry.attributes.position;
    geometry.setAttribute(ROW, new BufferAttribute(new Float32Array(count).fill(row), 1));
    geometry.setIndex(Array.from({ length: count }, (_, i) => i));
    return { mesh: new Mesh(geometry), tile: "r0_c0", channel: "cells" };
  });
  const at = ([x, y]: readonly [number, number], gap_um: number) => {
    const ray: Ray = { origin: [x, y, -9], direction: [0, 0, 1] };
    return pickObject(ray, new Matrix4(), meshes, BOXES, gap_um, Uint8Array.of(1, 1), WHOLE);
  };

  it("hits nothing in the gap, and each object where it is drawn", () => {
    for (const [x, y] of WALL) {
      for (const [row, by] of [
        [0, -0.05],
        [1, 0.05],
      ]) {
        const beside = [x + by, y + by] as const;
        expect(at(beside, 0)?.row, `${beside}`).toBe(row);
        expect(at(beside, 0.6), `${beside}`).toBeNull();
      }
    }
    expect(at([1.5, 1.5], 0.6)?.row).toBe(0);
    expect(at([2.5, 2.5], 0.6)?.row).toBe(1);
  });
});
