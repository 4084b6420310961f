import { describe, expect, it } from "vitest";
import { includeChunks } from "./glsl_include";

describe("a shader's chunks", () => {
  it("stand in place of their include lines", () => {
    expect(includeChunks("a\n#include <x/y>\nb", { "x/y": "chunk\n" })).toBe("a\nchunk\nb");
  });

  it("must exist", () => {
    expect(() => includeChunks("#include <nowhere>", {})).toThrow("no shader chunk nowhere");
  });
});
