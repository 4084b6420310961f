/**
 * Tests of the object chunks' numbers: the byte of a row, the light of a flag, a position drawn
 * inwards by the gap.
 */
import { readdir, readFile } from "node:fs/promises";
import { Matrix4 } from "three";
import { expect, it } from "vitest";
import { NEIGHBOUR, PICKED, PLAIN, SELECTED } from "../../src/objects/flags";
import { middleOf } from "../../src/objects/gap";
import { prepareBarePage } from "../support/browser/bare_page";
import { describeInChromium } from "../support/browser/skip";
import { along, BOXES, CELLS, isWithin, WALL, WIDTH_UM } from "../support/concave_cells";
import { runProgram } from "../support/shaders/chunk";

const FOLDER = new URL("../../src/objects/chunks/", import.meta.url);

async function chunk(name: string): Promise<Record<string, string>> {
  return { [`chunks/${name}`]: await readFile(new URL(`${name}.glsl`, FOLDER), "utf8") };
}

describeInChromium("the object chunks", () => {
  const bare = prepareBarePage();

  it("are all tested here", async () => {
    expect((await readdir(FOLDER)).sort()).toEqual([
      "object_gap.glsl",
      "object_light.glsl",
      "object_stain.glsl",
      "object_texel.glsl",
    ]);
  });

  it("read the byte of a row, also across line ends", async () => {
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

  // the mesh's own steps, um, placed in the scene
  const umToScene = new Matrix4().makeRotationY(0.7).scale({ x: 0.01, y: 0.01, z: 0.01 } as never);
  umToScene.setPosition(0.1, 1.5, -0.8);
  const stepToUm = new Matrix4().makeScale(0.002, 0.002, 0.002).setPosition(-1, -2, -3);
  const matrix = ({ elements }: Matrix4) => `mat4(${elements.map((v) => v.toFixed(9)).join(", ")})`;
  const toScene = umToScene.clone().multiply(stepToUm);
  /** Position of a point of a row's object as it is drawn, um. */
  const drawn = async (row: number, place_um: readonly number[], gap_um: number) => {
    const steps = place_um.map((v, i) => ((v + 1 + i) / 0.002).toFixed(3));
    const head = "uniform sampler2D uMiddles;\n#include <chunks/object_gap>\n";
    const body = `oColor.xyz = objectDrawnIn(vec3(${steps}), ${matrix(toScene)}, ${matrix(umToScene)},
      objectMiddle(uMiddles, ${256 + row}.0), ${gap_um.toFixed(3)});`;
    const texels = [0, 1].flatMap((line) =>
      Array.from({ length: 256 }, (_, i) =>
        line === 1 && i < 2 ? middleOf(BOXES, i) : [9, 9, 9, 9],
      ),
    );
    const uniforms = {
      uMiddles: { size: [256, 2], channels: 4 as const, texels: texels.flat(), isFloat: true },
    };
    const found = await runProgram(bare.page, await chunk("object_gap"), head, body, uniforms);
    return found.slice(0, 3).map((v, i) => 0.002 * v - 1 - i);
  };

  it("draw touching cells with a concave corner inside their own outlines, with a gap between", async () => {
    const gap_um = 0.2 * WIDTH_UM;
    const outlines: [number, number][][] = [];
    for (const [row, outline] of CELLS.entries()) {
      const places: [number, number][] = [];
      for (const [x, y] of outline) {
        const [toX, toY, toZ] = await drawn(row, [x, y, 0], gap_um);
        places.push([toX, toY]);
        // Half of the gap at either end of the narrowest side.
        expect(toZ).toBeCloseTo(gap_um / 2, 3);
      }
      outlines.push(places);
      for (const place of along(places)) expect(isWithin(outline, place), `${place}`).toBe(true);
    }
    for (const place of WALL) {
      for (const outline of outlines) expect(isWithin(outline, place), `${place}`).toBe(false);
    }
    const [one, next] = outlines;
    expect(next[0][0] - one[3][0]).toBeCloseTo(0.4, 3); // corner and notch: 0.1 and 0.3
  });

  it("leave a fifth of an object at any gap, and all of it without a gap", async () => {
    for (const [gap_um, left] of [
      [0, 1],
      [99, 0.2],
    ]) {
      const found = await drawn(0, [3, 0, 1], gap_um);
      for (const [i, v] of [1.5, -1.5, -0.5].entries()) {
        expect(found[i]).toBeCloseTo(1.5 + left * v, 3);
      }
    }
  });

  it("blend a stain over a colour by its intensity, limited to 0 and 1", async () => {
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

  it("light picked objects most, then selected ones, then neighbours, and not the others", async () => {
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
