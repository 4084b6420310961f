import { describe, expect, it } from "vitest";
import { RAYMARCH_FRAGMENT } from "../volumes/shaders/sources";
import { includeChunks } from "./glsl_include";

describe("a shader's chunks", () => {
  it("stand in place of their include lines", () => {
    expect(includeChunks("a\n#include <x/y>\nb", { "x/y": "chunk\n" })).toBe("a\nchunk\nb");
  });

  it("must exist", () => {
    expect(() => includeChunks("#include <nowhere>", {})).toThrow("no shader chunk nowhere");
  });

  it("are all in the ray-march", () => {
    expect(RAYMARCH_FRAGMENT).not.toContain("#include");
    expect(RAYMARCH_FRAGMENT).toContain("vec2 intersectBox(");
  });
});
