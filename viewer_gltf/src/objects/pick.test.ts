import { BufferAttribute, BufferGeometry, Group, Matrix4, Mesh, SphereGeometry } from "three";
import { describe, expect, it } from "vitest";
import { WHOLE } from "../math/clip";
import type { Ray } from "../math/vec3";
import { ROW } from "./object_material";
import { pickObject } from "./pick";

/** Three balls of radius 1 along z, at 0, 4 and 8, as one mesh that stands turned, moved and scaled. */
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
  const pick = (ray: Ray, flags = ALL, clip = WHOLE) =>
    pickObject(ray, world, surfaces, boxes, flags, clip);

  it("meets the nearest, at its surface, in lengths of its direction", () => {
    const met = pick(ALONG);
    expect(met?.row).toBe(0);
    expect(met?.tile).toBe("r0_c0");
    expect(met?.distance).toBeCloseTo((10 - Math.sqrt(1 - 0.02)) / 2, 1);
    expect(pick({ origin: [0.1, 0.1, 20], direction: [0, 0, -1] })?.row).toBe(2);
  });

  it("goes through what is hidden", () => {
    expect(pick(ALONG, Uint8Array.of(0, 1, 1))?.row).toBe(1);
    expect(pick(ALONG, Uint8Array.of(0, 0, 0))).toBeNull();
  });

  it("goes through what is cut away, into what is cut open", () => {
    const plane = (z: number) => ({
      ...WHOLE,
      plane: { normal: [0, 0, -1] as const, offset_um: -z },
    });
    expect(pick(ALONG, ALL, plane(2))?.row).toBe(1);
    const open = pick(ALONG, ALL, plane(4)); // its half behind is met from within
    expect(open?.row).toBe(1);
    expect(open?.distance).toBeCloseTo((14 + Math.sqrt(1 - 0.02)) / 2, 1);
  });

  it("meets nothing in the corner of a box, beside the object itself", () => {
    expect(pick({ origin: [0.95, 0.95, -10], direction: [0, 0, 1] })).toBeNull();
    expect(pick({ origin: [5, 0, -10], direction: [0, 0, 1] })).toBeNull();
  });

  it("meets what it begins inside of", () => {
    expect(pick({ origin: [0, 0, 4], direction: [1, 0, 0] })?.row).toBe(1);
  });
});
