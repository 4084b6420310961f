/**
 * Tests of the path tracer's chunks against known numbers: random numbers, scattering and lighting,
 * free flight, the history of a trembling view, and tone mapping.
 */
import { type Matrix4, PerspectiveCamera, type Vector3 } from "three";
import { describe, expect, it } from "vitest";
import { environmentTables } from "../../src/pathtrace/environment_sampling";
import { viewOf } from "../../src/pathtrace/eye_rays";
import { prepareBarePage } from "../support/browser/bare_page";
import { describeInChromium } from "../support/browser/skip";
import { seeded } from "../support/seeded";
import type { Texture } from "../support/shaders/chunk";

const number = (v: number) => v.toExponential(9);
const vec = (...v: readonly number[]) => `vec${v.length}(${v.map(number).join(", ")})`;
const unit = (v: readonly number[]) => v.map((each) => each / Math.hypot(...v));
const dot = (a: readonly number[], b: readonly number[]) => a.reduce((s, v, i) => s + v * b[i], 0);
const floats = (size: readonly number[], texels: readonly number[]): Texture => ({
  size,
  channels: texels.length === size.reduce((a, b) => a * b) ? 1 : 4,
  texels: [...texels],
  isFloat: true,
});

describeInChromium("the path tracer's chunks", () => {
  const bare = prepareBarePage();

  function run(
    names: readonly string[],
    head: string,
    body: string,
    textures: Readonly<Record<string, Texture>> = {},
    pixels = 1,
  ) {
    const samplers = Object.entries(textures)
      .map(([name, { size }]) => `uniform sampler${size.length}D ${name};`)
      .join("\n");
    return bare.run(names, `${samplers}\n${head}`, body, textures, pixels);
  }

  /** Samples of a pixel: few, so that floats are exact enough. */
  const TURNS = 256;
  const PIXEL = "int(gl_FragCoord.x)";
  /**
   * Means of the four numbers that `body` adds to `sum` for each sample of a pixel; `i` counts all
   * samples.
   */
  const meanOf = (body: string) =>
    `vec4 sum = vec4(0.0);
     for (int k = 0; k < ${TURNS}; k++) { int i = ${TURNS} * ${PIXEL} + k; ${body} }
     oColor = sum / ${TURNS}.0;`;
  const PIXELS = 256;
  const COUNT = PIXELS * TURNS;
  /** Four standard errors of a mean of COUNT numbers of unit variance. */
  const SLACK = 4 / Math.sqrt(COUNT);

  describe("draw random numbers", () => {
    it("that are uniform between 0 and 1 and independent", async () => {
      const body = meanOf(
        `float a = random(); float b = random();
         if (a < 0.0 || a >= 1.0) sum += 1e6;
         sum += vec4(a, a * a, (a - 0.5) * (b - 0.5) * 12.0, a < 0.1 ? 1.0 : 0.0);`,
      );
      const start = `seedRandom(uvec3(${PIXEL}, 5u, 7u));`;
      const found = await run(["random"], "", `${start}\n${body}`, {}, PIXELS);
      expect(Math.abs(found[0] - 1 / 2)).toBeLessThan(SLACK * Math.sqrt(1 / 12));
      expect(Math.abs(found[1] - 1 / 3)).toBeLessThan(SLACK * Math.sqrt(4 / 45));
      expect(Math.abs(found[2])).toBeLessThan(SLACK);
      expect(Math.abs(found[3] - 0.1)).toBeLessThan(SLACK * 0.3);
    });

    it("that are independent of the next pixels to the side and above, and of the next sample", async () => {
      // the first number after each seed, as in a shader
      const at = (x: string, y: string, n: string) =>
        `seedRandom(uvec3(uint(${x}), uint(${y}), uint(${n}))); float `;
      const body = meanOf(
        `int x = i % 256; int y = i / 256;
         ${at("x", "y", "1")} here = random() - 0.5;
         ${at("x + 1", "y", "1")} beside = random() - 0.5;
         ${at("x", "y + 1", "1")} above = random() - 0.5;
         ${at("x", "y", "2")} later = random() - 0.5;
         sum += 12.0 * here * vec4(beside, above, later, 1.0 / sqrt(12.0));`,
      );
      const found = await run(["random"], "", body, {}, PIXELS);
      for (const v of found) expect(Math.abs(v)).toBeLessThan(SLACK);
    });
  });

  describe("scatter", () => {
    const [GLOSS, FROM] = [60, unit([0.3, -0.8, -0.5])];
    const NORMAL = unit([-0.2, 1, 0.3]);
    const along = (a: readonly number[], by: number, b: readonly number[]) =>
      a.map((v, i) => v + by * b[i]);
    const MIRRORED = along(FROM, -2 * dot(FROM, NORMAL), NORMAL);
    /** A direction nearly within the surface: half of its lobe lies below. */
    const GRAZING = unit(along([1, 0, 0], 0.02 - NORMAL[0], NORMAL));

    const cases = [
      ["isotropically", "PHASE", 0, MIRRORED],
      ["forward", "PHASE", 0.6, MIRRORED],
      ["back", "PHASE", -0.4, MIRRORED],
      ["by a matt surface", "DIFFUSE", 0, MIRRORED],
      ["by a glossy surface", "GLOSSY", 0, MIRRORED],
      ["by a glossy surface at a grazing angle", "GLOSSY", 0, GRAZING],
    ] as const;

    const head = (g: number) =>
      `const float uAnisotropy = ${number(g)}; const float uGloss = ${number(GLOSS)};`;
    const scatter = (way: string, mirrored: readonly number[]) =>
      `seedRandom(uvec3(${PIXEL}, 2u, 3u)); vec3 from = ${vec(...FROM)};
       Scatter s = Scatter(${way}, ${vec(...NORMAL)}, ${vec(...mirrored)});`;
    /** The density integrated over the sphere, and the mean of `value` weighted by it. */
    const integrated = (value: string) =>
      `vec4 sum = vec4(0.0);
       float z = gl_FragCoord.x / 256.0 - 1.0;
       for (int k = 0; k < 256; k++) {
         float phi = (float(k) + 0.5) / 128.0 * PI;
         vec3 to = vec3(sqrt(1.0 - z * z) * vec2(cos(phi), sin(phi)), z);
         sum += scatterDensity(s, from, to) * ${value};
       }
       oColor = sum * PI / 64.0;`;
    const PLANES = 512;

    for (const [name, way, g, mirrored] of cases) {
      it(`${name}: the density integrates to 1, and samples follow it`, async () => {
        const start = scatter(way, mirrored);
        const names = ["random", "phase_function"];
        const whole = (value: string) => run(names, head(g), start + integrated(value), {}, PLANES);
        const direction = await whole("vec4(to, 1.0)");
        // a high power is not very exact on a GPU
        const grid = way === "GLOSSY" ? 0.012 : 0.002;
        expect(Math.abs(direction[3] - 1)).toBeLessThan(grid);
        const square = "vec4(to * to, to.x * to.y)";
        const squares = await whole(square);
        const drawn = (value: string) =>
          run(
            names,
            head(g),
            start + meanOf(`vec3 to = sampleScatter(s, from); sum += ${value};`),
            {},
            PIXELS,
          );
        const found = await drawn("vec4(to, length(to))");
        expect(Math.abs(found[3] - 1)).toBeLessThan(1e-4);
        for (const k of [0, 1, 2]) {
          expect(Math.abs(found[k] - direction[k]), `part ${k}`).toBeLessThan(SLACK + grid);
        }
        (await drawn(square)).forEach((v, k) => {
          expect(Math.abs(v - squares[k]), `square ${k}`).toBeLessThan(SLACK + grid);
        });
        // compares the mean cosines with theory
        if (way === "PHASE") expect(Math.abs(dot(found.slice(0, 3), FROM) - g)).toBeLessThan(SLACK);
        if (way === "DIFFUSE") {
          expect(Math.abs(dot(found.slice(0, 3), NORMAL) - 2 / 3)).toBeLessThan(SLACK);
        }
        if (name === "by a glossy surface") {
          const cosine = dot(found.slice(0, 3), MIRRORED);
          expect(Math.abs(cosine - (GLOSS + 1) / (GLOSS + 2))).toBeLessThan(SLACK);
        }
      });
    }

    it("never below a surface", async () => {
      for (const way of ["DIFFUSE", "GLOSSY"]) {
        const body = `vec3 to = sampleScatter(s, from);
          sum += vec4(dot(to, s.normal) < -1e-5 ? 1.0 : 0.0,
            scatterDensity(s, from, to - 2.0 * dot(to, s.normal) * s.normal), 0.0, 0.0);`;
        const start = scatter(way, GRAZING);
        const names = ["random", "phase_function"];
        const found = await run(names, head(0), start + meanOf(body), {}, 16);
        expect(found.slice(0, 2)).toEqual([0, 0]);
      }
    });

    it("around any axis by the requested angle", async () => {
      for (const axis of [[0, 0, 1], [0, 0, -1], unit([1, -2, -0.5]), unit([-1, 0.1, 3])]) {
        const call = `vec3 a = ${vec(...axis)}; vec3 one = around(a, 0.3, 0.1);
          oColor = vec4(dot(one, a), dot(around(a, 0.3, 0.6), one), length(one),
            dot(around(a, 0.3, 0.35), one));`;
        const found = await run(["random", "phase_function"], head(0), call);
        const sine2 = 1 - 0.3 ** 2;
        [0.3, 0.09 - sine2, 1, 0.09].forEach((v, i) => {
          expect(found[i]).toBeCloseTo(v, 4); // half a turn further, and a quarter further
        });
      }
    });
  });

  describe("the environment light", () => {
    const [width, height] = [8, 4];
    const random = seeded(5);
    const rgb = Float32Array.from({ length: 3 * width * height }, () => random() ** 4);
    rgb.set([0, 0, 0], 3 * 11); // a dark texel
    rgb.set([20, 5, 1], 3 * 13);
    const tables = environmentTables({ width, height, rgb });
    const pairs = Array.from({ length: width * height }, (_, i) => [
      tables.aliases[2 * i],
      tables.aliases[2 * i + 1],
      0,
      0,
    ]).flat();
    const textures = {
      uEnvironment: floats([width, height], [...tables.light]),
      uAliases: floats([width, height], pairs),
    };
    const look = (body: string, pixels = 1) =>
      run(["random", "environment"], "", body, textures, pixels);
    const texel = (column: number, row: number) =>
      [...rgb].slice(3 * (row * width + column), 3 * (row * width + column) + 3);
    const luminance = ([r, g, b]: readonly number[]) => 0.2126 * r + 0.7152 * g + 0.0722 * b;

    it("is read from the map: its top is up, its left edge at the back, its first quarter on the right", async () => {
      const at = async (dir: readonly number[]) =>
        (await look(`oColor = environmentAt(${vec(...unit(dir))});`)).slice(0, 3);
      for (const [dir, column, row] of [
        [[0.01, 1, -0.1], 0, 0],
        [[0.01, -1, -0.1], 0, 3],
        [[0.1, 0.2, -1], 0, 1],
        [[-0.1, 0.2, -1], 7, 1],
        [[1, -0.2, -0.1], 1, 2],
        [[1, -0.2, 0.1], 2, 2],
        [[0.1, 0.2, 1], 3, 1],
        [[-1, 0.2, 0.1], 5, 1],
      ] as const) {
        expect(await at(dir), `${dir}`).toEqual(texel(column, row));
      }
    });

    it("is sampled by a density that integrates to 1 over the sphere", async () => {
      const steps = 256; // steps of each of the two angles, a multiple of the texels
      const body = `float whole = 0.0;
        for (int j = 0; j < ${steps}; j++) {
          float sum = 0.0;
          float v = (float(j) + 0.5) / ${steps}.0 * 3.14159265;
          for (int k = 0; k < ${steps}; k++) {
            float u = (float(k) + 0.5) / ${steps}.0 * 6.2831853;
            sum += environmentAt(vec3(sin(v) * sin(u), cos(v), -sin(v) * cos(u))).a;
          }
          whole += sum * sin(v) * 6.2831853 * 3.14159265 / ${steps ** 2}.0;
        }
        oColor = vec4(whole);`;
      expect((await look(body))[0]).toBeCloseTo(1, 3);
    });

    it("is sampled in proportion to its light, and returns the light", async () => {
      const weights = Array.from({ length: width * height }, (_, i) => {
        const row = Math.floor(i / width);
        const cap = (at: number) => Math.cos((at / height) * Math.PI);
        return luminance(texel(i % width, row)) * (cap(row) - cap(row + 1));
      });
      const sum = weights.reduce((a, b) => a + b);
      for (const i of [0, 5, 11, 13, 14, 22, 31]) {
        const share = weights[i] / sum;
        const body = `vec4 light; vec3 to = sampleEnvironment(light);
          ivec2 texel = environmentTexel(to);
          bool isThere = texel == ivec2(${i % width}, ${Math.floor(i / width)});
          sum += vec4(isThere, light != environmentAt(to), length(to), 0.0);`;
        const start = `seedRandom(uvec3(${PIXEL}, 2u, ${i}u));`;
        const found = await look(`${start}\n${meanOf(body)}`, PIXELS);
        const error = Math.sqrt(Math.max(share * (1 - share), 1e-9));
        expect(Math.abs(found[0] - share), `texel ${i}`).toBeLessThan(SLACK * error + 1e-4);
        // at a texel's edge a float may fall on the other side
        expect(found[1]).toBeLessThan(1e-3);
        expect(found[2]).toBeCloseTo(1, 4);
      }
    });
  });

  describe("the medium", () => {
    /** Planes that remove nothing. */
    const NOWHERE = Array(3).fill([0, 0, 0, 1]);
    const cornerOf = (planes: readonly (readonly number[])[]) =>
      `const vec4 uCorner[3] = vec4[3](${planes.map((each) => vec(...each)).join(", ")});`;
    const entry = (c: number, i: number) => [
      i / 255,
      1 - i / 255,
      c === 0 ? 0.5 : 0.25,
      (c + 1) * i ** 2,
    ];
    const table = [0, 1].flatMap((c) => Array.from({ length: 256 }, (_, i) => entry(c, i)).flat());
    const medium = (channels: number, intensities: readonly number[]) =>
      run(
        ["in_corner", "medium"],
        `#define CHANNELS ${channels}
         ${cornerOf(NOWHERE)}
         const vec3 uTexLow = vec3(0.25, 0.75, 0.25); const vec3 uTexPerUm = vec3(0.5, -0.5, 0.25);
         vec4 sampleIntensities(vec3 p) { return vec4(p, 0.0); }`,
        `oColor = mediumOf(${vec(...intensities)});`,
        { uMedium: floats([256, 2], table) },
      );

    it("is linear between a table's entries", async () => {
      const found = await medium(1, [100.25 / 255, 0.9, 0, 0]);
      const [a, b] = [entry(0, 100), entry(0, 101)];
      a.forEach((v, k) => {
        expect(found[k]).toBeCloseTo(v + 0.25 * (b[k] - v), k === 3 ? 1 : 4);
      });
      // The lookup is clamped to the last entry.
      expect((await medium(1, [1.2, 0, 0, 0]))[3]).toBeCloseTo(255 ** 2, 1);
      expect((await medium(1, [-0.1, 0, 0, 0]))[3]).toBe(0);
    });

    it("has the sum of its channels' densities, weighted towards the colour of the denser one", async () => {
      const found = await medium(2, [51 / 255, 102 / 255, 0, 0]);
      const [a, b] = [entry(0, 51), entry(1, 102)];
      expect(found[3] / (a[3] + b[3])).toBeCloseTo(1, 4);
      for (const k of [0, 1, 2]) {
        const expected = (a[k] * a[3] + b[k] * b[3]) / (a[3] + b[3]);
        expect(found[k]).toBeCloseTo(expected, 4);
      }
      expect(await medium(2, [0, 0, 1, 1])).toEqual([0, 0, 0, 0]);
    });

    it("is looked up by um of the box, with rows against y", async () => {
      const textures = { uMedium: floats([256, 2], table) };
      const head = `#define CHANNELS 1
        ${cornerOf(NOWHERE)}
        const vec3 uTexLow = vec3(0.25, 0.75, 0.25); const vec3 uTexPerUm = vec3(0.5, -0.5, 0.25);
        vec4 sampleIntensities(vec3 p) { return vec4(p.y, 0.0, 0.0, 0.0); }`;
      const body = "oColor = mediumAt(vec3(0.3, 0.5, 0.1));"; // texture y 0.5
      const [red] = await run(["in_corner", "medium"], head, body, textures);
      expect(red).toBeCloseTo(0.5, 4);
    });

    it("is empty in the corner in front of the slices, so scattered light passes through it", async () => {
      const at = async (...p: number[]) => {
        const head = `#define CHANNELS 1
          ${cornerOf([
            [1, 0, 0, 2],
            [0, 1, 0, 3],
            [0, 0, -1, -1], // z < 1
          ])}
          const vec3 uTexLow = vec3(0.0); const vec3 uTexPerUm = vec3(0.1);
          vec4 sampleIntensities(vec3 p) { return vec4(1.0); }`;
        const body = `oColor = mediumAt(${vec(...p)});`;
        const textures = { uMedium: floats([256, 2], table) };
        return (await run(["in_corner", "medium"], head, body, textures))[3];
      };
      expect(await at(2.1, 3.1, 0.9)).toBe(0);
      for (const p of [
        [1.9, 3.1, 0.9],
        [2.1, 2.9, 0.9],
        [2.1, 3.1, 1.1],
      ]) {
        expect(await at(...p)).toBeCloseTo(255 ** 2, 1);
      }
    });
  });

  describe("light travels", () => {
    const FROM = [0.7, 15.2, 0.9];
    const DIR = unit([1, -0.8, 0.6]);
    const [LENGTH, SIZE] = [14, 16]; // um; a box of 16 um with texels of 1 um

    /** `extinction` is GLSL of p in um; the majorants belong to bricks of `brick` texels. */
    async function fly(
      extinction: string,
      brick: number,
      majorants: readonly number[],
      body: string,
      stride_um = 0,
    ) {
      const n = SIZE / brick;
      const head = `
        const float uStride = ${number(stride_um)};
        const vec3 uTexLow = vec3(0.0, 1.0, 0.0);
        const vec3 uTexPerUm = ${vec(1 / SIZE, -1 / SIZE, 1 / SIZE)};
        const vec3 uTexels = vec3(${number(SIZE)});
        const vec3 uBrick = vec3(${brick.toFixed(1)});
        vec4 mediumAt(vec3 p) { return vec4(1.0, 1.0, 1.0, ${extinction}); }`;
      const start = `seedRandom(uvec3(${PIXEL}, 8u, 7u));
        vec3 from = ${vec(...FROM)}; vec3 dir = ${vec(...DIR)};`;
      const textures = {
        uVolume: { size: [SIZE, SIZE, SIZE], channels: 1, texels: new Array(SIZE ** 3).fill(0) },
        uMajorants: floats([n, n, n], majorants),
      } as const;
      const program = `${start}\n${meanOf(body)}`;
      return run(["random", "delta_tracking"], head, program, textures, PIXELS);
    }

    const flight = `vec4 medium; float t = track(from, dir, 0.0, ${number(LENGTH)}, medium);
      sum += vec4(t < 0.0, t < 0.0 ? 0.0 : t, t < 0.0 ? 0.0 : t * t, 0.0);`;
    const SIGMA = 0.2;
    const random = seeded(2);
    const uneven = (n: number) => Array.from({ length: n ** 3 }, () => SIGMA * (1 + 3 * random()));

    it.each([
      ["with one tight majorant", 16, [SIGMA]],
      ["with one majorant that is far too large", 16, [10 * SIGMA]],
      ["through bricks with different majorants", 8, uneven(2)],
      ["through many small bricks", 2, uneven(8)],
    ] as const)("as far as expected in a uniform medium, %s", async (_, brick, majorants) => {
      const found = await fly(number(SIGMA), brick, majorants, flight);
      const through = Math.exp(-SIGMA * LENGTH);
      // moments of an exponential distribution cut off at LENGTH
      const first = 1 / SIGMA - through * (LENGTH + 1 / SIGMA);
      const second =
        2 / SIGMA ** 2 - through * (LENGTH ** 2 + (2 * LENGTH) / SIGMA + 2 / SIGMA ** 2);
      const spread = Math.sqrt(second - first ** 2);
      expect(Math.abs(found[0] - through)).toBeLessThan(SLACK * Math.sqrt(through * (1 - through)));
      expect(Math.abs(found[1] - first)).toBeLessThan(SLACK * spread);
      expect(Math.abs(found[2] - second)).toBeLessThan(SLACK * LENGTH * spread);
    });

    it("through an increasingly dense medium by its optical depth, with both kinds of tracking", async () => {
      // extinction p.x / 32, in um along the ray: (0.7 + 0.707 t) / 32
      const at = (x: number) => x / 32;
      const depth = at(FROM[0]) * LENGTH + (at(DIR[0]) * LENGTH ** 2) / 2;
      const through = Math.exp(-depth);
      for (const brick of [16, 8, 4]) {
        const n = SIZE / brick;
        // the larger end of each brick along x
        const majorants = Array.from({ length: n ** 3 }, (_, i) => at(brick * ((i % n) + 1)));
        const body = `${flight}
          sum.w += transmittance(from, dir, 0.0, ${number(LENGTH)});`;
        const found = await fly("p.x / 32.0", brick, majorants, body);
        const error = Math.sqrt(through * (1 - through));
        expect(Math.abs(found[0] - through), `bricks of ${brick}`).toBeLessThan(SLACK * error);
        // a share varies less than a value of 0 or 1
        expect(Math.abs(found[3] - through), `bricks of ${brick}`).toBeLessThan(SLACK * error);
      }
    });

    it("as far by a set number of steps as by tracking", async () => {
      const depth = (FROM[0] * LENGTH + (DIR[0] * LENGTH ** 2) / 2) / 32;
      const through = Math.exp(-depth);
      const body = `${flight}
        sum.w += transmittance(from, dir, 0.0, ${number(LENGTH)});`;
      // no majorants are needed, because steps look up only the medium
      const found = await fly("p.x / 32.0", 4, new Array(64).fill(0), body, 0.4);
      const error = Math.sqrt(through * (1 - through));
      expect(Math.abs(found[0] - through)).toBeLessThan(SLACK * error);
      expect(Math.abs(found[3] - through)).toBeLessThan(SLACK * error);
    });

    it("freely through empty space", async () => {
      const body = `${flight} sum.w += transmittance(from, dir, 0.0, ${number(LENGTH)});`;
      const found = await fly("0.0", 4, new Array(64).fill(0), body);
      expect([found[0], found[3]]).toEqual([1, 1]);
    });
  });

  describe("the history of a pixel", () => {
    const N = 4;
    /** An eye with 4 x 4 pixels, 10 um in front of the plane z = 0, of which it sees 4 x 4 um. */
    function eye(aside_um: number) {
      const fov = (2 * Math.atan(2 / 10) * 180) / Math.PI;
      const camera = new PerspectiveCamera(fov, 1, 1, 100);
      camera.position.set(aside_um, 0, 10);
      camera.updateMatrixWorld();
      return viewOf(camera, camera.matrixWorld.clone().identity());
    }
    const mat = (m: Matrix4) => `mat4(${m.elements.map(number).join(", ")})`;
    const at = (v: Vector3) => vec(v.x, v.y, v.z);
    type Pixel = Readonly<{ sums: readonly number[]; moments: readonly number[] }>;

    /** Distance of the plane's point in a pixel. */
    const awayOf = (i: number) => Math.hypot((i % N) - 1.5, Math.floor(i / N) - 1.5, 10);
    const seen = (i: number, n: number, color: number): Pixel => ({
      sums: [color * n, 0, 0, n],
      moments: [color ** 2 * n, n, n * awayOf(i), n],
    });
    const empty = (n: number): Pixel => ({ sums: [0, 0, 0, 0], moments: [0, n, 0, 0] });

    /** Sums or moments of the pixel at (x, y). */
    function history(
      kind: number,
      aside_um: number,
      [x, y]: readonly number[],
      pixels: readonly Pixel[],
      part: "sums" | "moments",
    ) {
      const [before, now] = [eye(0), eye(aside_um)];
      const head = `const vec3 uSize = vec3(10.0); const int uHistory = ${kind};
        const vec4 uPart = ${vec(0, 0, N, N)}; const float uMostHistory = 48.0;
        const mat4 uToBox = ${mat(now.toBox)}; const mat4 uToBefore = ${mat(before.fromBox)};
        const vec3 uEyeAt = ${at(now.eye)}; const vec3 uEyeBefore = ${at(before.eye)};
        const vec2 uTurn = vec2(0.0, 1.0); const float uCalm = 0.0; const uint uSample = 1u;`;
      const call = `oColor = historyAt(ivec2(${x}, ${y}), ${vec(x + 0.5, y + 0.5)}).${part};`;
      return run(["random", "reproject_search", "temporal_history"], head, call, {
        uSums: floats(
          [N, N],
          pixels.flatMap(({ sums }) => sums),
        ),
        uMoments: floats(
          [N, N],
          pixels.flatMap(({ moments }) => moments),
        ),
        uNoisiness: floats([1, 1], [0]),
      });
    }

    const plane = Array.from({ length: N * N }, (_, i) => seen(i, 10, (i % N) + 1));
    const expectClose = (found: readonly number[], expected: readonly number[]) =>
      expected.forEach((v, k) => {
        expect(Math.abs(found[k] - v), `${found}`).toBeLessThan(1e-3 * Math.max(1, Math.abs(v)));
      });

    it("is empty for a new view, and complete for the same view", async () => {
      expect(await history(0, 0, [1, 2], plane, "sums")).toEqual([0, 0, 0, 0]);
      expect(await history(1, 0, [1, 2], plane, "sums")).toEqual(plane[9].sums);
      expectClose(await history(1, 0, [1, 2], plane, "moments"), plane[9].moments);
      expectClose(await history(2, 0, [1, 2], plane, "sums"), plane[9].sums); // a shift of zero
    });

    it("is interpolated where the surface was before", async () => {
      // The eye moved right by a quarter of a pixel, so the surface was farther right before.
      expectClose(await history(2, 0.25, [1, 2], plane, "sums"), [22.5, 0, 0, 10]);
      expectClose(await history(2, -0.5, [2, 1], plane, "sums"), [25, 0, 0, 10]);
      expectClose((await history(2, 1, [1, 2], plane, "moments")).slice(1), [
        10,
        10 * awayOf(10),
        10,
      ]);
    });

    it("is limited to a number of samples, in the same proportions", async () => {
      const many = plane.map(({ sums, moments }) => ({
        sums: sums.map((v) => 20 * v),
        moments: moments.map((v) => 20 * v),
      }));
      expectClose(await history(2, 0.25, [1, 2], many, "sums"), [48 * 2.25, 0, 0, 48]);
      expect((await history(2, 0.25, [1, 2], many, "moments"))[1]).toBeCloseTo(48, 3);
      // A view at rest keeps all samples.
      expectClose(await history(1, 0, [1, 2], many, "sums"), many[9].sums);
    });

    it("is dropped where another surface was seen, or outside the earlier image", async () => {
      const nearer = plane.map((pixel, i) =>
        i % N === 2 ? { ...pixel, moments: [0, 10, 10 * (awayOf(i) - 2), 10] } : pixel,
      );
      // between column 1, which is the same surface, and column 2, which is another
      expectClose(await history(2, 0.25, [1, 2], nearer, "sums"), [20, 0, 0, 10]);
      expect(await history(2, 2, [3, 2], plane, "sums")).toEqual([0, 0, 0, 0]); // outside the image
    });

    it("is empty where nothing was hit, and keeps an edge in place", async () => {
      const edge = plane.map((pixel, i) => (i % N >= 2 ? empty(10) : pixel));
      expectClose(await history(2, 0.25, [1, 2], edge, "sums"), [15, 0, 0, 7.5]);
      expect((await history(2, 0.25, [1, 2], edge, "moments"))[1]).toBeCloseTo(10, 3);
      // An edge has passed by. It is found from this side too, by the distance of the box's middle,
      // since nothing else gives the distance.
      expect((await history(2, -1, [2, 2], edge, "sums"))[0]).toBeCloseTo(20, 0);
      expect(await history(2, 1, [1, 2], edge, "sums")).toEqual([0, 0, 0, 0]);
      expect((await history(2, 1, [1, 2], edge, "moments"))[1]).toBeCloseTo(10, 3);
    });

    const share = (turn: readonly number[], calm: number, noisiness: number) =>
      run(
        ["random", "reproject_search", "temporal_history"],
        `const vec3 uSize = vec3(1.0); const int uHistory = 0; const vec4 uPart = vec4(0.0);
         const float uMostHistory = 1.0; const mat4 uToBox = mat4(1.0); const mat4 uToBefore = mat4(1.0);
         const vec3 uEyeAt = vec3(0.0); const vec3 uEyeBefore = vec3(0.0);
         const vec2 uTurn = ${vec(...turn)}; const float uCalm = ${number(calm)}; uint uSample;`,
        `float count = 0.0;
         for (int n = 0; n < 64; n++) {
           uSample = uint(n);
           for (int i = 0; i < 256; i++) count += isDrawn(ivec2(i % 16, i / 16)) ? 1.0 : 0.0;
         }
         oColor = vec4(count / 16384.0);`,
        {
          uSums: floats([1, 1], [0, 0, 0, 0]),
          uMoments: floats([1, 1], [0, 0, 0, 0]),
          uNoisiness: floats([16, 16], new Array(256).fill(noisiness)),
        },
      ).then(([found]) => found);

    it("gets new samples in turn, and more often if it is noisy", async () => {
      expect(await share([0, 1], 0, 0)).toBe(1); // every tile is drawn
      const quarters = [];
      for (const turn of [0, 0.25, 0.5, 0.75]) quarters.push(await share([turn, 0.25], 0, 0));
      expect(quarters.reduce((a, b) => a + b)).toBe(1);
      expect(Math.min(...quarters)).toBeGreaterThan(0.15);
      const near = 4 / Math.sqrt(16_384);
      for (const [noisiness, expected] of [
        [0, 1 / 8],
        [0.005, 1 / 2],
        [0.01, 1],
        [1000, 1],
      ]) {
        const found = await share([0, 1], 0.01, noisiness);
        expect(Math.abs(found - expected), `${noisiness}`).toBeLessThan(near);
      }
    });
  });

  describe("map tones", () => {
    const tone = (call: string) => run(["tone_map"], "", `oColor = vec4(${call}, 1.0);`);
    const expectColor = (found: readonly number[], expected: readonly number[]) =>
      expected.forEach((v, k) => {
        expect(found[k], `${found}`).toBeCloseTo(v, 4);
      });

    it("to hue, saturation and lightness and back", async () => {
      // computed by hand: CSS's hsl(20, 60 %, 40 %) is rgb(64 %, 32 %, 16 %)
      for (const [rgb, hsl] of [
        [
          [0.64, 0.32, 0.16],
          [20 / 360, 0.6, 0.4],
        ],
        [
          [0.16, 0.64, 0.32],
          [140 / 360, 0.6, 0.4],
        ],
        [
          [0.32, 0.16, 0.64],
          [260 / 360, 0.6, 0.4],
        ],
        [
          [0.64, 0.16, 0.32],
          [340 / 360, 0.6, 0.4],
        ],
        [
          [1, 1, 0],
          [60 / 360, 1, 0.5],
        ],
        [
          [0.3, 0.3, 0.3],
          [0, 0, 0.3],
        ],
        [
          [0, 0, 0],
          [0, 0, 0],
        ],
        [
          [1, 1, 1],
          [0, 0, 1],
        ],
      ]) {
        expectColor(await tone(`hslOf(${vec(...rgb)})`), hsl);
        expectColor(await tone(`rgbOf(${vec(...hsl)})`), rgb);
      }
    });

    it("with the given change only", async () => {
      const toned = (change: readonly number[]) =>
        tone(`toned(${vec(0.64, 0.32, 0.16)}, ${vec(...change)})`);
      expectColor(await toned([0, 1, 0]), [0.64, 0.32, 0.16]);
      expectColor(await toned([1 / 3, 1, 0]), [0.16, 0.64, 0.32]);
      expectColor(await toned([-1 / 3, 1, 0]), [0.32, 0.16, 0.64]);
      expectColor(await toned([0, 0, 0]), [0.4, 0.4, 0.4]);
      expectColor(await toned([0, 0.5, 0]), [0.52, 0.36, 0.28]);
      expectColor(await toned([0, 10, 0]), [0.8, 0.8 / 3, 0]); // limited to full saturation
      expectColor(await toned([0, 1, -0.2]), [0.32, 0.16, 0.08]);
      expectColor(await toned([0, 1, 0.9]), [1, 1, 1]);
    });

    it("with the film curve", async () => {
      expectColor(await tone("filmic(vec3(0.0, 1.0, 100.0))"), [0, 2.54 / 3.16, 1]);
      const [a, b, c] = await tone("filmic(vec3(0.1, 0.4, 2.0))");
      expect([a, b, c]).toEqual([a, b, c].sort((x, y) => x - y));
      expect(c).toBeLessThan(1);
    });
  });

  describe("the light of the stand-in march", () => {
    const alpha = 0.5;
    /**
     * Returns a calibrated pixel. The mean colours are those of 4 path-traced and 2 marched pixels
     * that see the specimen.
     */
    const calibrated = async (
      light: readonly number[],
      traced: readonly number[],
      marched: readonly number[],
      coverage = [4, 2],
    ) => {
      const sums = (mean: readonly number[], coverage: number) =>
        floats([1, 1], [...mean.map((v) => coverage * v), coverage]);
      const premultiplied = [...light.map((v) => alpha * v), alpha];
      const found = await bare.run(
        ["calibrated_light"],
        "",
        `oColor = vec4(calibrated(${vec(...premultiplied)}) / ${number(alpha)}, 1.0);`,
        { uTracedLight: sums(traced, coverage[0]), uMarchedLight: sums(marched, coverage[1]) },
      );
      return found.slice(0, 3);
    };
    const expectNear = (found: readonly number[], wanted: readonly number[]) =>
      found.forEach((v, k) => {
        expect(v).toBeCloseTo(wanted[k], 5);
      });

    it("is multiplied to the path-traced mean, colour by colour", async () => {
      const [traced, marched] = [
        [0.6, 0.3, 0.15],
        [0.2, 0.2, 0.3],
      ];
      expectNear(await calibrated(marched, traced, marched), traced);
      expectNear(await calibrated([0.1, 0.4, 0.9], traced, marched), [0.3, 0.6, 0.45]);
    });

    it("gains a colour that it hardly has by addition", async () => {
      const traced = [0.1, 0.4, 0.1];
      const marched = [0.001, 0.2, 0.001];
      const brightness = ([r, g, b]: readonly number[]) => 0.2126 * r + 0.7152 * g + 0.0722 * b;
      const most = (4 * brightness(traced)) / brightness(marched);
      expectNear(await calibrated(marched, traced, marched), traced);
      const shine = 0.1 - 0.001 * most;
      expectNear(await calibrated([0.01, 0.1, 0], traced, marched), [
        0.01 * most + shine,
        0.2,
        shine,
      ]);
    });

    it("is unchanged if either image shows nothing", async () => {
      const light = [0.1, 0.4, 0.9];
      for (const coverage of [
        [0, 2],
        [4, 0],
      ])
        expectNear(await calibrated(light, [0.6, 0.3, 0.1], [0.2, 0.2, 0.2], coverage), light);
    });
  });

  it("find a ramp's gradient in the box's directions, over two voxels", async () => {
    const slope = [0.02, -0.05, 0.01]; // intensity per um
    const perUm = [1 / 40, -1 / 60, 1 / 24];
    const head = `const float uVoxel = 0.5;
      vec4 sampleIntensities(vec3 p) {
        float v = dot(${vec(...slope)}, (p - 0.5) / ${vec(...perUm)});
        return vec4(0.25 * v, 0.0, 0.75 * v, 0.0);
      }`;
    const body = `oColor = vec4(gradientAt(vec3(0.5), ${vec(...perUm)}, vec4(1.0)), 1.0);`;
    const found = await run(["gradient"], head, body);
    slope.forEach((v, k) => {
      expect(found[k]).toBeCloseTo(v, 5); // two voxels are 1 um
    });
  });

  it("ignore values that alternate sideways: terraces of a sharp edge, noise", async () => {
    const head = `const float uVoxel = 0.5;
      vec4 sampleIntensities(vec3 p) {
        vec3 um = (p - 0.5) * 10.0;
        return vec4(0.1 * sign(um.x) * cos(3.14159265 * um.y) + 0.2 * um.z, 0.0, 0.0, 0.0);
      }`;
    const body = "oColor = vec4(gradientAt(vec3(0.5), vec3(0.1), vec4(1.0)), 1.0);";
    const [x, y, z] = await run(["gradient"], head, body);
    expect(x).toBeCloseTo(0, 5); // on the axis alone it would be 0.2
    expect(y).toBeCloseTo(0, 5);
    expect(z).toBeCloseTo(0.2, 5);
  });
});
