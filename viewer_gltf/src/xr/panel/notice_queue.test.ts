import { describe, expect, it } from "vitest";
import type { Rect } from "../../panel/canvas/draw_list";
import {
  advanceTelling,
  NOTHING_TOLD,
  type Telling,
  TOLD_HEIGHT,
  TOLD_S,
  TOLD_WIDTH,
  tell,
  toldMarks,
} from "./notice_queue";

const told = (...texts: readonly string[]) => texts.reduce(tell, NOTHING_TOLD);
function after(telling: Telling, seconds: number): readonly string[] {
  let now = telling;
  for (let t = 0; t < seconds; t += 0.125) now = advanceTelling(now, 0.125);
  return now.texts;
}

describe("what is told in stereo", () => {
  it("goes by itself after six seconds", () => {
    expect(after(told("a"), TOLD_S - 0.25)).toEqual(["a"]);
    expect(after(told("a"), TOLD_S)).toEqual([]);
    expect(advanceTelling(NOTHING_TOLD, 1)).toBe(NOTHING_TOLD);
  });

  it("is read one after the other, the newest at once", () => {
    expect(told("a", "b").texts).toEqual(["a", "b"]);
    expect(after(told("a", "b"), TOLD_S)).toEqual(["b"]);
    expect(after(told("a", "b"), 2 * TOLD_S)).toEqual([]);
  });

  it("is the newest three, each once", () => {
    expect(told("a", "b", "c", "d").texts).toEqual(["b", "c", "d"]);
    expect(told("a", "b", "a").texts).toEqual(["b", "a"]);
    const again = tell(advanceTelling(told("a"), 5), "a");
    expect(after(again, TOLD_S - 0.25)).toEqual(["a"]);
    const third = tell(advanceTelling(told("a", "b"), 5), "c");
    expect(after(third, 1)).toEqual(["b", "c"]);
  });

  it("fits the plane, however long", () => {
    const long = "a word ".repeat(60);
    for (const texts of [["short"], [long], [long, "short", long], [long, long, long]]) {
      const marks = toldMarks(texts);
      const boxes = marks.flatMap((mark) => (mark.kind === "box" ? [mark.rect] : []));
      const bottom = ({ y, height }: Rect) => y + height;
      boxes.slice(1).forEach((box, i) => {
        expect(box.y).toBeGreaterThan(bottom(boxes[i]));
      });
      for (const { rect } of marks) {
        expect(rect.x + rect.width).toBeLessThanOrEqual(TOLD_WIDTH);
        expect(bottom(rect)).toBeLessThanOrEqual(TOLD_HEIGHT);
      }
    }
  });
});
