import { ShaderLib } from "three";
import { describe, expect, it } from "vitest";
import { insertInto, insertionsOf } from "./insert_glsl";

const SHADER = "uniform float a;\nvoid main() {\n\t#include <first>\n\tif (a > 0.0) { }\n}\n";
const linesOf = (text: string) =>
  text
    .split("\n")
    .map((line) => line.trim())
    .filter((line) => line !== "");

describe("inserted GLSL", () => {
  it("goes to the places that its file declares", () => {
    const file = [
      "// What the pieces are for.",
      ...["#insert start", "one();"],
      ...["#insert before <first>", "two();"],
      ...["#insert after <first>", "three();", "four();"],
      ...["#insert main_start", "five();"],
      ...["#insert main_end", "six();"],
    ].join("\n");
    expect(linesOf(insertInto(SHADER, insertionsOf(file)))).toEqual([
      ...["one();", "uniform float a;", "void main() {", "five();"],
      ...["two();", "#include <first>", "three();", "four();"],
      ...["if (a > 0.0) { }", "six();", "}"],
    ]);
  });

  it("is rejected by a shader without such a place", () => {
    const insertions = insertionsOf("#insert after <second>\nnever();");
    expect(() => insertInto(SHADER, insertions)).toThrow('no place "after <second>"');
    expect(() => insertInto("", insertionsOf("#insert main_end\nnever();"))).toThrow("main_end");
  });

  it("is inserted literally, even with dollar signs", () => {
    const insertions = insertionsOf("#insert main_start\nfloat b = a; // $& $1\n");
    expect(insertInto(SHADER, insertions)).toContain("float b = a; // $& $1");
  });

  it("finds its places in each of three's own shaders that need it", () => {
    const both = insertionsOf(
      "#insert start\na();\n#insert main_start\nb();\n#insert main_end\nc();",
    );
    for (const { vertexShader, fragmentShader } of [
      ...[ShaderLib.basic, ShaderLib.sprite, ShaderLib.standard],
    ]) {
      expect(linesOf(insertInto(vertexShader, both)).at(-2)).toBe("c();");
      expect(insertInto(fragmentShader, both)).toMatch(/void main\(\) \{\s+b\(\);/);
    }
  });
});
