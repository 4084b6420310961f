import { describe, expect, it } from "vitest";
import { keepApart, type LabelBox } from "./keep_apart";

const box = (x: number, y: number, isAbove = true, width = 4, height = 1): LabelBox => ({
  x,
  y,
  width,
  height,
  isAbove,
});

function overlaps(a: LabelBox, b: LabelBox): boolean {
  return a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height && b.y < a.y + a.height;
}

describe("labels in the scene", () => {
  it("stay where they are if they do not overlap", () => {
    expect(keepApart([box(0, 0), box(5, 0), box(0, 2)])).toEqual([0, 0, 0]);
    expect(keepApart([])).toEqual([]);
  });

  it("move away from their own points if they overlap earlier labels", () => {
    const [first, up, down] = keepApart([box(0, 0), box(1, 0.5), box(2, 0.3, false)]);
    expect(first).toBe(0);
    expect(up).toBeGreaterThan(0.5);
    expect(down).toBeLessThan(-1.3);
  });

  it("never overlap, however many lie at one place", () => {
    const boxes = Array.from({ length: 12 }, (_, i) =>
      box((i * 7) % 5, ((i * 3) % 4) / 2, i % 3 !== 0, 3 + (i % 3), 1 + (i % 2)),
    );
    const shifts = keepApart(boxes);
    const placed = boxes.map((each, i) => ({ ...each, y: each.y + shifts[i] }));
    placed.forEach((a, i) => {
      for (const b of placed.slice(i + 1)) expect(overlaps(a, b)).toBe(false);
    });
  });
});
