/** Numbers out of the shader's small chunks: where rays are cut, and how the disc weighs. */
import type { Page } from "playwright-core";
import { afterAll, beforeAll, expect, it } from "vitest";
import { toHex } from "../src/color";
import { type Browser, launch } from "./driver/chromium";
import { describeInChromium } from "./driver/skip";
import { readChunks, runProgram } from "./march/chunk";

describeInChromium("the shader's chunks", () => {
  let browser: Browser;
  let page: Page;

  beforeAll(async () => {
    browser = await launch({ width: 64, height: 64 });
    page = await browser.context.newPage();
  });
  afterAll(() => browser?.close());

  async function run(names: readonly string[], head: string, body: string) {
    const chunks = await readChunks(...names);
    const includes = names.map((name) => `#include <chunks/${name}>`).join("\n");
    return runProgram(page, chunks, `${head}\n${includes}`, body);
  }

  const vec = (...v: number[]) => `vec${v.length}(${v.map((n) => n.toExponential(9)).join(", ")})`;

  it("cut a ray's span by box and plane", async () => {
    const clip = async (plane: number[], dir: number[]) => {
      const head = `const vec3 uClipLow = vec3(-1.0); const vec3 uClipHigh = vec3(1.0, 1.0, 3.0);
        const vec4 uClipPlane = ${vec(...plane)};`;
      const call = `vec3 dir = ${vec(...dir)};
        oColor = clipSpan(vec2(0.0, 20.0), vec3(0.0, 0.0, -5.0), dir, 1.0 / dir).xyxy;`;
      return (await run(["intersect_box", "clip_span"], head, call)).slice(0, 2);
    };
    const ahead = [1e-9, 1e-9, 1];
    expect(await clip([0, 0, 0, 1], ahead)).toEqual([4, 8]); // the box alone: z -1 to 3
    expect(await clip([0, 0, 1, 2], ahead)).toEqual([4, 7]); // kept up to z = 2
    expect(await clip([0, 0, -1, -2], ahead)).toEqual([7, 8]); // kept from z = 2 on
    const [from, to] = await clip([1, 0, 0, -0.5], ahead); // beside the ray: all is cut away
    expect(from).toBeGreaterThan(to);
    expect(await clip([1, 0, 0, 0.5], ahead)).toEqual([4, 8]); // beside the ray: nothing is
  });

  it("cut a ray's span by the disc's cone, seen from its apex or from another eye", async () => {
    const cone = async (eye: number[], dir: number[]) => {
      const length = Math.hypot(...dir);
      const head = `const vec3 uApex = vec3(0.0); const vec3 uAxis = vec3(0.0, 0.0, -1.0);
        const vec2 uDisc = vec2(0.9, ${Math.SQRT1_2});`; // 45 degrees
      const unit = vec(...dir.map((v) => v / length));
      const call = `oColor = coneSpan(vec2(0.0, 10.0), ${vec(...eye)}, ${unit}).xyxy;`;
      return (await run(["cone_span"], head, call)).slice(0, 2);
    };
    expect(await cone([0, 0, 0], [0.5, 0, -1])).toEqual([0, 10]); // within
    const [a, b] = await cone([0, 0, 0], [1.5, 0, -1]); // beside
    expect(a).toBeGreaterThanOrEqual(b);
    // along x, two ahead of the apex: the cone is x = -2 to 2 there
    const [from, to] = await cone([-5, 0, -2], [1, 0, 0]);
    expect(from).toBeCloseTo(3, 4);
    expect(to).toBeCloseTo(7, 4);
    // parallel to the axis, one aside: in from z = -1 on
    const [enters, leaves] = await cone([1, 0, 0], [0, 0, -1]);
    expect(enters).toBeCloseTo(1, 4);
    expect(leaves).toBe(10);
    const [behind, none] = await cone([-5, 0, 2], [1, 0, 0]); // behind the apex
    expect(behind).toBeGreaterThan(none);
  });

  it("weigh the disc from 1 within its inner radius to 0 beyond its outer one", async () => {
    const weigh = async (degrees: number) => {
      const at = (degrees * Math.PI) / 180;
      const p = vec(3 * Math.sin(at), 0, -3 * Math.cos(at));
      const [inner, outer] = [10, 20].map((deg) => Math.cos((deg * Math.PI) / 180));
      const call = `oColor = vec4(discWeight(${p}, vec3(0.0), vec3(0.0, 0.0, -1.0),
        ${vec(inner, outer)}));`;
      return (await run(["disc"], "", call))[0];
    };
    expect(await weigh(0)).toBe(1);
    expect(await weigh(9.9)).toBe(1);
    expect(await weigh(20.1)).toBe(0);
    const between = [await weigh(12), await weigh(15), await weigh(18)];
    expect(between).toEqual([...between].sort((a, b) => b - a));
    expect(between[0]).toBeLessThan(1);
    expect(between[2]).toBeGreaterThan(0);
  });

  it("let channels without a disc count everywhere, the others by the cube of their weight", async () => {
    const head = `const vec3 uApex = vec3(0.0); const vec3 uAxis = vec3(0.0, 0.0, -1.0);
      const vec2 uDisc = vec2(0.99, 0.9); const float uPresence = 0.5;
      const bvec4 uInDisc = bvec4(true, false, true, false);`;
    const far = await run(["disc", "weights"], head, "oColor = weights(vec3(5.0, 0.0, -1.0));");
    expect(far).toEqual([0, 0.5, 0, 0.5]);
    const near = await run(["disc", "weights"], head, "oColor = weights(vec3(0.0, 0.0, -1.0));");
    expect(near).toEqual([0.5, 0.5, 0.5, 0.5]);
    // cosine 0.945: half of the way, where the smooth step is a half
    const at = `vec3(${Math.sqrt(1 - 0.945 ** 2)}, 0.0, -0.945)`;
    const half = await run(["disc", "weights"], head, `oColor = weights(${at});`);
    expect(half[0]).toBeCloseTo(0.5 / 8, 4);
  });

  it("encode colours as sRGB", async () => {
    const linear = [0.002, 0.2, 0.75] as const;
    const found = await run(["encoded"], "", `oColor = vec4(encoded(${vec(...linear)}), 1.0);`);
    const hex = toHex(linear);
    [1, 3, 5].forEach((at, i) => {
      expect(255 * found[i]).toBeCloseTo(Number.parseInt(hex.slice(at, at + 2), 16), -0.5);
    });
  });

  it("tell by which cut a ray came in", async () => {
    const cut = async (planes: number[][], body: string) => {
      const lines = planes.map((plane, i) => `uCutsGiven[${i}] = ${vec(...plane)};`).join("\n");
      const chunks = await readChunks("cut");
      const text = chunks["chunks/cut"]
        .replace("uniform vec4 uCuts[7];", "vec4 uCutsGiven[7];")
        .replace("uniform int uCutCount;", `const int uCutCount = ${planes.length};`)
        .replaceAll("uCuts[", "uCutsGiven[");
      return runProgram(page, { "chunks/cut": text }, "#include <chunks/cut>", `${lines}\n${body}`);
    };
    const front = [0, 0, 1, 2]; // gone is z > 2
    const isCut = (p: string) => cut([front], `oColor = vec4(isCut(${p}) ? 1.0 : 0.0);`);
    expect((await isCut("vec3(0.0, 0.0, 3.0)"))[0]).toBe(1);
    expect((await isCut("vec3(0.0, 0.0, 1.0)"))[0]).toBe(0);
    const right = [1, 0, 0, 1]; // gone is x > 1
    const normal = (eye: string) =>
      cut([front, right], `oColor = vec4(cutNormal(${eye}, vec3(0.0)), 1.0);`);
    expect((await normal("vec3(0.0, 0.0, 9.0)")).slice(0, 3)).toEqual([0, 0, 1]);
    expect((await normal("vec3(9.0, 0.0, 1.0)")).slice(0, 3)).toEqual([1, 0, 0]);
    expect((await normal("vec3(0.5, 0.0, 1.0)")).slice(0, 3)).toEqual([0, 0, 0]); // on the kept side
    // through both: the one that is passed last
    expect((await normal("vec3(9.0, 0.0, 9.0)")).slice(0, 3)).toEqual([1, 0, 0]);
  });
});
