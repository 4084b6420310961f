import { describe, expect, it } from "vitest";
import { Fingers } from "./fingers";

const HEIGHT = 400;
const kinds = (gestures: readonly { kind: string }[]) => gestures.map(({ kind }) => kind);

describe("fingers on the split screen", () => {
  it("tap when they are lifted, not when they go down", () => {
    const fingers = new Fingers();
    expect(kinds(fingers.down(1, { x: 50, y: 50 }))).toEqual(["press"]);
    expect(fingers.move(1, { x: 56, y: 54 }, HEIGHT)).toEqual([]); // a thumb rolls a little
    expect(kinds(fingers.up(1))).toEqual(["tap", "release"]);
  });

  it("do not tap after a drag, even one that returns to its start", () => {
    const fingers = new Fingers();
    fingers.down(1, { x: 50, y: 50 });
    expect(kinds(fingers.move(1, { x: 90, y: 50 }, HEIGHT))).toEqual(["release", "drag"]);
    expect(kinds(fingers.move(1, { x: 50, y: 50 }, HEIGHT))).toEqual(["drag"]);
    expect(fingers.up(1)).toEqual([]);
  });

  it("drag by shares of the screen's height, counted from where they went down", () => {
    const fingers = new Fingers();
    fingers.down(1, { x: 50, y: 50 });
    let [x, y] = [0, 0];
    for (const to of [52, 80, 130]) {
      for (const gesture of fingers.move(1, { x: to, y: 150 - to / 2 }, HEIGHT)) {
        if (gesture.kind !== "drag") continue;
        x += gesture.x;
        y += gesture.y;
      }
    }
    expect(x).toBeCloseTo(80 / HEIGHT, 12);
    expect(y).toBeCloseTo(35 / HEIGHT, 12);
  });

  it("pinch: two fingers give the ratio of their distances and the motion of their midpoint", () => {
    const fingers = new Fingers();
    fingers.down(1, { x: 100, y: 100 });
    expect(kinds(fingers.down(2, { x: 200, y: 100 }))).toEqual(["release"]);
    const moves = [
      ...fingers.move(1, { x: 80, y: 140 }, HEIGHT),
      ...fingers.move(2, { x: 240, y: 140 }, HEIGHT),
    ];
    expect(kinds(moves)).toEqual(["pinch", "pinch"]);
    let [factor, x, y] = [1, 0, 0];
    for (const gesture of moves) {
      if (gesture.kind !== "pinch") continue;
      factor *= gesture.factor;
      x += gesture.x;
      y += gesture.y;
    }
    expect([factor, x, y]).toEqual([
      expect.closeTo(1.6, 12),
      expect.closeTo(10 / HEIGHT, 12),
      expect.closeTo(40 / HEIGHT, 12),
    ]);
    expect([...fingers.up(1), ...fingers.up(2)]).toEqual([]); // no finger taps after a pinch
  });

  it("start again after the browser cancels one, and go on with the one that is left", () => {
    const fingers = new Fingers();
    fingers.down(1, { x: 0, y: 0 });
    expect(kinds(fingers.cancel(1))).toEqual(["release"]);
    expect(fingers.up(1)).toEqual([]);
    expect(kinds(fingers.down(2, { x: 0, y: 0 }))).toEqual(["press"]);
    fingers.down(3, { x: 100, y: 0 });
    fingers.up(2);
    expect(fingers.move(3, { x: 140, y: 0 }, HEIGHT)).toEqual([
      { kind: "drag", x: 40 / HEIGHT, y: 0 },
    ]);
  });

  it("do nothing while they do not touch", () => {
    expect(new Fingers().move(1, { x: 500, y: 0 }, HEIGHT)).toEqual([]);
  });
});
