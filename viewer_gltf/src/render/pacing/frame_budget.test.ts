import { expect, it } from "vitest";
import { FrameBudget } from "./frame_budget";

/** A context without timer queries for the GPU. */
const gl = { getExtension: () => null } as unknown as WebGL2RenderingContext;

it("the frame budget reports late frames only while a moving view is slower than the display", () => {
  const pace = new FrameBudget(gl);
  const draw = (isMoving: boolean, interval_ms: number, frames: number) => {
    for (let i = 0; i < frames; i++) {
      pace.begin(isMoving, interval_ms, 60);
      pace.end();
    }
    return pace.isLate;
  };
  expect(draw(true, 16, 60)).toBe(false);
  expect(draw(true, 60, 60)).toBe(true);
  expect(draw(false, 5000, 1), "at rest").toBe(false);
  expect(draw(true, 5000, 1), "the first frame after a rest").toBe(false);
  expect(draw(true, 16, 120)).toBe(false);
});
