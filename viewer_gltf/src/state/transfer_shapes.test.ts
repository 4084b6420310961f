import { describe, expect, it } from "vitest";
import { COLUMNS, faultOf, MAX_SHAPES, ROWS, type Shape } from "../bundle/transfer_2d";
import {
  addShape,
  type HistogramPoint,
  hitTest,
  MIN_HEIGHT,
  MIN_WIDTH,
  makeShape,
  move,
  outline,
  rasterise,
  removeShape,
  replaceShape,
  resize,
} from "./transfer_shapes";

const RECTANGLE: Shape = {
  kind: "rectangle",
  values: [0.25, 1],
  gradients: [0.25, 1],
  tip: 0.625,
  color: [1, 0.5, 0],
  opacity: 0.5,
  softness: 1,
};
const TRIANGLE: Shape = {
  kind: "triangle",
  values: [0, 1],
  gradients: [0, 1],
  tip: 0.5,
  color: [0, 0, 1],
  opacity: 1,
  softness: 1,
};
const REACH = { value: 0.02, gradient: 0.03 };
const at = (value: number, gradient: number): HistogramPoint => ({ value, gradient });

/** One component of a table of 5 x 5 cells, by rows; the row of gradient 0 is first. */
function component(table: Uint8Array, i: number): number[][] {
  return Array.from({ length: 5 }, (_, row) =>
    Array.from({ length: 5 }, (_, column) => table[4 * (5 * row + column) + i]),
  );
}

describe("the table", () => {
  // computed by hand, as in tests/transfer/test_shapes2d.py; values and gradients are 0, 1/4, 1/2,
  // 3/4, 1
  it("fades towards the edges of a rectangle, but not at the ends of the histogram", () => {
    const table = rasterise([RECTANGLE], 5, 5);
    expect(component(table, 3)).toEqual([
      [0, 0, 0, 0, 0],
      [0, 0, 0, 0, 0],
      [0, 0, 57, 85, 85],
      [0, 0, 85, 128, 128],
      [0, 0, 85, 128, 128],
    ]);
    expect(component(table, 1)[3]).toEqual([255, 255, 128, 128, 128]);
  });

  it("widens from the tip of a triangle", () => {
    expect(component(rasterise([TRIANGLE], 5, 5), 3)).toEqual([
      [0, 0, 255, 0, 0],
      [0, 0, 255, 0, 0],
      [0, 0, 255, 0, 0],
      [0, 85, 255, 85, 0],
      [0, 128, 255, 128, 0],
    ]);
  });

  it("mixes the colours of overlapping shapes by their opacities", () => {
    const cell = 4 * (5 * 4 + 2);
    const table = rasterise([RECTANGLE, TRIANGLE], 5, 5);
    expect([...table.subarray(cell, cell + 4)]).toEqual([64, 32, 191, 255]);
  });

  it("is transparent and white without shapes", () => {
    const table = rasterise([]);
    expect(table.length).toBe(4 * ROWS * COLUMNS);
    expect([...table.subarray(0, 4)]).toEqual([255, 255, 255, 0]);
    expect(table.every((v, i) => v === (i % 4 === 3 ? 0 : 255))).toBe(true);
  });

  it("has the full opacity or none at hard edges", () => {
    const hard = { ...RECTANGLE, values: [0.3, 0.6] as const, softness: 0 };
    expect(component(rasterise([hard], 5, 5), 3)).toEqual([
      [0, 0, 0, 0, 0],
      ...Array.from({ length: 4 }, () => [0, 0, 128, 0, 0]),
    ]);
  });

  it("includes the tip of a triangle that lies between two cells", () => {
    const thin = { ...TRIANGLE, tip: 0.3737, values: [0.37, 0.378] as const, softness: 0 };
    const table = rasterise([thin]);
    for (let row = 0; row < ROWS; row++) {
      const alphas = table.filter((_, i) => i % 4 === 3);
      expect(alphas.subarray(row * COLUMNS, (row + 1) * COLUMNS).some((a) => a === 255)).toBe(true);
    }
  });
});

describe("the part under the pointer", () => {
  const box: Shape = { ...RECTANGLE, values: [0.2, 0.6], gradients: [0.3, 0.7] };
  const cone: Shape = { ...TRIANGLE, tip: 0.5, values: [0.3, 0.7], gradients: [0.2, 0.8] };

  it("is a rectangle's corner, edge or body", () => {
    const parts = new Map([
      ["top-left", at(0.21, 0.69)],
      ["top-right", at(0.6, 0.71)],
      ["bottom-left", at(0.19, 0.28)],
      ["bottom-right", at(0.61, 0.3)],
      ["left", at(0.21, 0.5)],
      ["right", at(0.59, 0.5)],
      ["bottom", at(0.4, 0.32)],
      ["top", at(0.4, 0.72)],
      ["body", at(0.4, 0.5)],
    ]);
    for (const [part, point] of parts) {
      expect(hitTest([box], point, REACH), part).toEqual({ index: 0, part });
    }
    expect(hitTest([box], at(0.1, 0.5), REACH)).toBeNull();
    expect(hitTest([box], at(0.4, 0.8), REACH)).toBeNull();
  });

  it("is a triangle's tip, upper corners, cut, or body between its sides", () => {
    expect(hitTest([cone], at(0.5, 0.01), REACH)?.part).toBe("tip");
    expect(hitTest([cone], at(0.3, 0.8), REACH)?.part).toBe("top-left");
    expect(hitTest([cone], at(0.71, 0.79), REACH)?.part).toBe("top-right");
    expect(hitTest([cone], at(0.5, 0.2), REACH)?.part).toBe("bottom");
    expect(hitTest([cone], at(0.5, 0.5), REACH)?.part).toBe("body");
    // the triangle is half as wide half-way up: 0.4 to 0.6 at a gradient of 0.4
    expect(hitTest([cone], at(0.41, 0.4), REACH)?.part).toBe("body");
    expect(hitTest([cone], at(0.36, 0.4), REACH)).toBeNull();
  });

  it("is the shape on top, unless another is selected", () => {
    expect(hitTest([box, cone], at(0.5, 0.5), REACH)).toEqual({ index: 1, part: "body" });
    expect(hitTest([box, cone], at(0.5, 0.5), REACH, 0)).toEqual({ index: 0, part: "body" });
    expect(hitTest([box, cone], at(0.5, 0.5), REACH, 7)).toEqual({ index: 1, part: "body" });
  });
});

describe("an edit", () => {
  it("moves a shape as far as the end of the histogram, and keeps its size", () => {
    const moved = move(RECTANGLE, at(-0.1, 5));
    expect(moved.values).toEqual([0.15, 0.9]);
    expect(moved.gradients).toEqual(RECTANGLE.gradients);
    const cone = { ...TRIANGLE, tip: 0.1, values: [0.3, 0.5] as const };
    expect(move(cone, at(-1, 0))).toMatchObject({ tip: 0 });
    expect(move(cone, at(-1, 0)).values[0]).toBeCloseTo(0.2);
    expect(move(cone, at(-1, 0)).values[1]).toBeCloseTo(0.4);
  });

  it("moves a part to a point inside the histogram, and keeps the smallest size", () => {
    const box: Shape = { ...RECTANGLE, values: [0.2, 0.6], gradients: [0.3, 0.7] };
    expect(resize(box, "top-right", at(0.9, 0.8))).toMatchObject({
      values: [0.2, 0.9],
      gradients: [0.3, 0.8],
    });
    expect(resize(box, "left", at(2, 0)).values).toEqual([0.6 - MIN_WIDTH, 0.6]);
    expect(resize(box, "bottom", at(0, 9)).gradients).toEqual([0.7 - MIN_HEIGHT, 0.7]);
    expect(resize(box, "top-left", at(-1, 7))).toMatchObject({
      values: [0, 0.6],
      gradients: [0.3, 1],
    });
    expect(resize(TRIANGLE, "tip", at(1.5, 0.4))).toEqual({ ...TRIANGLE, tip: 1 });
    expect(resize(box, "body", at(0, 0))).toBe(box);
  });

  it("leaves a valid shape, whatever its kind and place", () => {
    const places = [-1, 0, 0.001, 0.4, 0.999, 1, 2];
    const parts = ["tip", "top-left", "bottom-right", "bottom-left", "top", "left"] as const;
    for (const kind of ["rectangle", "triangle"] as const) {
      for (const value of places) {
        for (const gradient of places) {
          const made = makeShape(kind, at(value, gradient));
          expect(faultOf(made)).toBeNull();
          for (const part of parts) {
            const edited = resize(made, part, at(gradient, value));
            expect(faultOf(edited), JSON.stringify(edited)).toBeNull();
            expect(faultOf(move(edited, at(value - 0.5, gradient - 0.5)))).toBeNull();
          }
        }
      }
    }
  });

  it("adds, replaces and removes without changing the given list", () => {
    const shapes = Object.freeze([RECTANGLE]);
    expect(addShape(shapes, TRIANGLE)).toEqual([RECTANGLE, TRIANGLE]);
    expect(replaceShape(shapes, 0, TRIANGLE)).toEqual([TRIANGLE]);
    expect(removeShape([RECTANGLE, TRIANGLE], 0)).toEqual([TRIANGLE]);
    const full = Array.from({ length: MAX_SHAPES }, () => RECTANGLE);
    expect(addShape(full, TRIANGLE)).toBe(full);
  });
});

describe("a shape from outside", () => {
  it("is rejected with a reason", () => {
    expect(faultOf(TRIANGLE)).toBeNull();
    expect(faultOf({ ...TRIANGLE, values: [0.5, 0.5] })).toMatch(/values are \(0.5, 0.5\)/);
    expect(faultOf({ ...TRIANGLE, gradients: [0.5, 1.5] })).toMatch(/gradients/);
    expect(faultOf({ ...TRIANGLE, tip: Number.NaN })).toMatch(/tip is NaN/);
    expect(faultOf({ ...TRIANGLE, color: [0, 2, 0] })).toMatch(/green is 2/);
    expect(faultOf({ ...TRIANGLE, kind: "circle" as "triangle" })).toBe(
      "kind is circle, expected rectangle or triangle",
    );
  });

  it("is drawn by its corners", () => {
    expect(outline(RECTANGLE)).toHaveLength(4);
    expect(outline(TRIANGLE)).toEqual([at(0.5, 0), at(1, 1), at(0, 1)]);
  });
});
