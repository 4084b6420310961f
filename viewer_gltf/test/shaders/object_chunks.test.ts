/** Numbers out of the chunks that colour objects: the byte of a row, and the light of a flag. */
import { readdir, readFile } from "node:fs/promises";
import { expect, it } from "vitest";
import { NEIGHBOUR, PICKED, PLAIN, SELECTED } from "../../src/objects/flags";
import { prepareBarePage } from "../support/browser/bare_page";
import { describeInChromium } from "../support/browser/skip";
import { runProgram } from "../support/shaders/chunk";

const FOLDER = new URL("../../src/objects/chunks/", import.meta.url);

async function chunk(name: string): Promise<Record<string, string>> {
  return { [`chunks/${name}`]: await readFile(new URL(`${name}.glsl`, FOLDER), "utf8") };
}

describeInChromium("the chunks of objects", () => {
  const bare = prepareBarePage();

  it("are all tested here", async () => {
    expect((await readdir(FOLDER)).sort()).toEqual([
      "object_light.glsl",
      "object_stain.glsl",
      "object_texel.glsl",
    ]);
  });

  it("read the byte of a row, over the ends of lines", async () => {
    const texels = Array.from({ length: 256 * 3 }, (_, i) => (i * 7) % 256);
    const head = "uniform sampler2D uBytes;\n#include <chunks/object_texel>\n";
    const rows = [0, 1, 255, 256, 511, 512, 767];
    for (const row of rows) {
      const body = `oColor = vec4(float(objectTexel(uBytes, ${row}.0)));`;
      const uniforms = { uBytes: { size: [256, 3], channels: 1 as const, texels } };
      const [found] = await runProgram(
        bare.page,
        await chunk("object_texel"),
        head,
        body,
        uniforms,
      );
      expect(found, `row ${row}`).toBe((row * 7) % 256);
    }
  });

  it("lay a stain over a colour by its intensity, no less than none and no more than all", async () => {
    for (const [intensity, share] of [
      [0, 0],
      [0.25, 0.25],
      [1, 1],
      [-1, 0],
      [2, 1],
    ]) {
      const body = `oColor = vec4(objectStain(vec3(0.2, 0.4, 0.6), vec3(1.0, 0.0, 0.5), ${intensity.toFixed(2)}), 1.0);`;
      const head = "#include <chunks/object_stain>\n";
      const found = await runProgram(bare.page, await chunk("object_stain"), head, body);
      for (const [i, end] of [1, 0, 0.5].entries()) {
        const start = [0.2, 0.4, 0.6][i];
        expect(found[i]).toBeCloseTo(start + share * (end - start), 6);
      }
    }
  });

  it("light the picked most, then the selected, then neighbours, and leave the others", async () => {
    const lit = async (flag: number) => {
      const body = `oColor = vec4(objectLight(vec3(0.2, 0.4, 0.6), ${flag}), 1.0);`;
      const head = "#include <chunks/object_light>\n";
      return (await runProgram(bare.page, await chunk("object_light"), head, body)).slice(0, 3);
    };
    const plain = await lit(PLAIN);
    for (const i of [0, 1, 2]) expect(plain[i]).toBeCloseTo([0.2, 0.4, 0.6][i], 6);
    const [near, selected, picked] = await Promise.all([NEIGHBOUR, SELECTED, PICKED].map(lit));
    for (const i of [0, 1, 2]) {
      expect(near[i]).toBeGreaterThan(plain[i]);
      expect(selected[i]).toBeGreaterThan(near[i]);
      expect(picked[i]).toBeGreaterThan(selected[i]);
      expect(picked[i]).toBeLessThan(1);
    }
  });
});
