import { expect, it } from "vitest";
import { hasHalfFloats, type LinearContext } from "./linear_target";

const RGBA16F = 0x881a;

function context(extensions: readonly string[], samples: readonly number[]): LinearContext {
  return {
    getExtension: (name: string) => (extensions.includes(name) ? {} : null),
    getInternalformatParameter: (_: number, format: number) =>
      format === RGBA16F ? Int32Array.from(samples) : null,
    RENDERBUFFER: 0x8d41,
    RGBA16F,
    SAMPLES: 0x80a9,
  } as LinearContext;
}

it("a render target has half floats if either extension allows drawing into them", () => {
  expect(hasHalfFloats(context(["EXT_color_buffer_float"], [8, 4, 2]))).toBe(true);
  expect(hasHalfFloats(context(["EXT_color_buffer_half_float"], [4]))).toBe(true);
});

it("a render target has no half floats if they can't be drawn into or multisampled", () => {
  expect(hasHalfFloats(context([], [4]))).toBe(false);
  expect(hasHalfFloats(context(["EXT_color_buffer_float"], []))).toBe(false);
  expect(hasHalfFloats(context(["EXT_color_buffer_float"], [2]))).toBe(false);
});
