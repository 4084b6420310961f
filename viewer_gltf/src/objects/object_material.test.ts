import { BoxGeometry, SphereGeometry } from "three";
import { expect, it } from "vitest";
import { outwards } from "./object_material";

it("vertices of one object at one position move in the same direction, so that no crease tears", () => {
  const box = new BoxGeometry(2, 2, 2); // has three vertices at each corner, one for each side
  const { position } = box.attributes;
  const ways = outwards(box, new Float32Array(position.count));
  for (let i = 0; i < position.count; i++) {
    const corner = [position.getX(i), position.getY(i), position.getZ(i)];
    const way = [...ways.subarray(3 * i, 3 * i + 3)];
    expect(way).toEqual(corner.map((v) => Math.round((127 * v) / Math.sqrt(3))));
  }
});

it("vertices of two touching objects move in their own directions", () => {
  const box = new BoxGeometry(2, 2, 2);
  const rows = Float32Array.from({ length: 24 }, (_, i) => (i < 4 ? 0 : 1));
  expect([...outwards(box, rows).subarray(0, 3)]).toEqual([127, 0, 0]); // the first side alone
});

it("vertices move along the normal if the surface has no crease", () => {
  const ball = new SphereGeometry(1, 12, 8);
  const { normal } = ball.attributes;
  const ways = outwards(ball, new Float32Array(normal.count));
  expect(Math.abs(ways[3 * 20] - 127 * normal.getX(20))).toBeLessThan(1);
});
