import { describe, expect, it } from "vitest";
import { includeChunks } from "./glsl_include";

describe("the chunks of a shader", () => {
  it("replace their include lines", () => {
    expect(includeChunks("a\n#include <x/y>\nb", { "x/y": "chunk\n" })).toBe("a\nchunk\nb");
  });

  it("must exist", () => {
    expect(() => includeChunks("#include <nowhere>", {})).toThrow('no shader chunk "nowhere"');
  });
});
