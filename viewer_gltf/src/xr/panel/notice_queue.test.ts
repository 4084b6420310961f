import { describe, expect, it } from "vitest";
import type { Rect } from "../../panel/canvas/draw_list";
import { howItWorks } from "../how_it_works";
import {
  ANNOUNCED_S,
  type Announcements,
  advanceAnnouncements,
  announce,
  NO_ANNOUNCEMENTS,
  NOTICE_HEIGHT,
  NOTICE_WIDTH,
  noticeMarks,
} from "./notice_queue";

const announced = (...texts: readonly string[]) => texts.reduce(announce, NO_ANNOUNCEMENTS);
function after(announcements: Announcements, seconds: number): readonly string[] {
  let now = announcements;
  for (let t = 0; t < seconds; t += 0.125) now = advanceAnnouncements(now, 0.125);
  return now.texts;
}

describe("a notice in stereo", () => {
  it("disappears by itself after five seconds", () => {
    expect(after(announced("a"), ANNOUNCED_S - 0.25)).toEqual(["a"]);
    expect(after(announced("a"), ANNOUNCED_S)).toEqual([]);
    expect(advanceAnnouncements(NO_ANNOUNCEMENTS, 1)).toBe(NO_ANNOUNCEMENTS);
  });

  it("appears at once, and the oldest disappears first", () => {
    expect(announced("a", "b").texts).toEqual(["a", "b"]);
    expect(after(announced("a", "b"), ANNOUNCED_S)).toEqual(["b"]);
    expect(after(announced("a", "b"), 2 * ANNOUNCED_S)).toEqual([]);
  });

  it("is one of at most three, without repeats", () => {
    expect(announced("a", "b", "c", "d").texts).toEqual(["b", "c", "d"]);
    expect(announced("a", "b", "a").texts).toEqual(["b", "a"]);
    const again = announce(advanceAnnouncements(announced("a"), 5), "a");
    expect(after(again, ANNOUNCED_S - 0.25)).toEqual(["a"]);
    const third = announce(advanceAnnouncements(announced("a", "b"), 5), "c");
    expect(after(third, 1)).toEqual(["b", "c"]);
  });

  it("has letters as large as fit", () => {
    const sizesOf = (...texts: readonly string[]) =>
      noticeMarks(texts).flatMap((mark) => (mark.kind === "text" ? [mark.size] : []));
    // more than 2 degrees, which are 6 pixels on a phone with 280 pixels for each eye
    expect(Math.min(...sizesOf(howItWorks("before-eyes")))).toBeGreaterThan(60);
    expect(sizesOf("Quality: low", "Choosing by gaze: off")).toEqual([80, 80]);
    expect(sizesOf("a word ".repeat(60))).toEqual([48]);
  });

  it("fits the quad, even with long texts", () => {
    const long = "a word ".repeat(60);
    for (const texts of [["short"], [long], [long, "short", long], [long, long, long]]) {
      const marks = noticeMarks(texts);
      const boxes = marks.flatMap((mark) => (mark.kind === "box" ? [mark.rect] : []));
      const bottom = ({ y, height }: Rect) => y + height;
      boxes.slice(1).forEach((box, i) => {
        expect(box.y).toBeGreaterThan(bottom(boxes[i]));
      });
      for (const { rect } of marks) {
        expect(rect.x + rect.width).toBeLessThanOrEqual(NOTICE_WIDTH);
        expect(bottom(rect)).toBeLessThanOrEqual(NOTICE_HEIGHT);
      }
    }
  });
});
