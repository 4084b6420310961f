import { describe, expect, it } from "vitest";
import { RAYMARCH_FRAGMENT } from "./sources";

describe("the text of the ray march", () => {
  it("includes all of its chunks", () => {
    expect(RAYMARCH_FRAGMENT).not.toContain("#include");
    expect(RAYMARCH_FRAGMENT).toContain("vec2 intersectBox(");
  });
});
