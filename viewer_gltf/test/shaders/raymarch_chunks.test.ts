/**
 * Tests of the shader's small chunks against known numbers: where rays are clipped and end, the
 * weight of the disc, and how a sample is read, lit and shifted.
 */
import { readdir, readFile } from "node:fs/promises";
import { DataUtils } from "three";
import { describe, expect, it } from "vitest";
import { blueNoise, NOISE_SIZE } from "../../src/gpu/blue_noise";
import { toHex } from "../../src/math/color";
import { prepareBarePage } from "../support/browser/bare_page";
import { describeInChromium } from "../support/browser/skip";
import { readChunks, runProgram, type Texture } from "../support/shaders/chunk";

describeInChromium("the shader chunks", () => {
  const bare = prepareBarePage();
  const { run } = bare;

  const vec = (...v: number[]) => `vec${v.length}(${v.map((n) => n.toExponential(9)).join(", ")})`;

  it("clip a ray's span by box and plane", async () => {
    const nowhere = [0, 0, 0, 1];
    const clip = async (plane: number[], dir: number[], corner = [nowhere, nowhere, nowhere]) => {
      const head = `const vec3 uClipLow = vec3(-1.0); const vec3 uClipHigh = vec3(1.0, 1.0, 3.0);
        const vec4 uClipPlane = ${vec(...plane)};
        const vec4 uCorner[3] = vec4[3](${corner.map((each) => vec(...each)).join(", ")});`;
      const call = `vec3 dir = ${vec(...dir)};
        oColor = clipSpan(vec2(0.0, 20.0), vec3(0.0, 0.0, -5.0), dir, 1.0 / dir).xyxy;`;
      return (await run(["intersect_box", "clip_span"], head, call)).slice(0, 2);
    };
    const ahead = [1e-9, 1e-9, 1];
    expect(await clip([0, 0, 0, 1], ahead)).toEqual([4, 8]); // the box alone: z from -1 to 3
    expect(await clip([0, 0, 1, 2], ahead)).toEqual([4, 7]); // kept up to z = 2
    expect(await clip([0, 0, -1, -2], ahead)).toEqual([7, 8]); // kept from z = 2 on
    const [from, to] = await clip([1, 0, 0, -0.5], ahead); // the kept part is beside the ray
    expect(from).toBeGreaterThan(to);
    expect(await clip([1, 0, 0, 0.5], ahead)).toEqual([4, 8]); // the removed part is beside the ray
    // the corner x > -0.5, y > -0.5, z < 0, in which the ray begins, and a corner beside it
    const [x, y, z] = [
      [1, 0, 0, -0.5],
      [0, 1, 0, -0.5],
      [0, 0, -1, 0],
    ];
    expect(await clip(nowhere, ahead, [x, y, z])).toEqual([5, 8]);
    expect(await clip(nowhere, ahead, [[1, 0, 0, 0.5], y, z])).toEqual([4, 8]);
    // The corner is only behind the eye.
    expect(await clip(nowhere, ahead, [x, y, [0, 0, 1, 0]])).toEqual([4, 8]);
  });

  it("clip a ray's span by the disc's cone, from its apex or from another eye", async () => {
    const cone = async (eye: number[], dir: number[]) => {
      const length = Math.hypot(...dir);
      const head = `const vec3 uApex = vec3(0.0); const vec3 uAxis = vec3(0.0, 0.0, -1.0);
        const float uReach = ${Math.SQRT1_2};`; // 45 degrees
      const unit = vec(...dir.map((v) => v / length));
      const call = `oColor = coneSpan(vec2(0.0, 10.0), ${vec(...eye)}, ${unit}).xyxy;`;
      return (await run(["cone_span"], head, call)).slice(0, 2);
    };
    expect(await cone([0, 0, 0], [0.5, 0, -1])).toEqual([0, 10]); // inside
    const [a, b] = await cone([0, 0, 0], [1.5, 0, -1]); // outside
    expect(a).toBeGreaterThanOrEqual(b);
    // along x at two units ahead of the apex, where the cone is from x = -2 to 2
    const [from, to] = await cone([-5, 0, -2], [1, 0, 0]);
    expect(from).toBeCloseTo(3, 4);
    expect(to).toBeCloseTo(7, 4);
    // parallel to the axis at a distance of one: inside from z = -1 on
    const [enters, leaves] = await cone([1, 0, 0], [0, 0, -1]);
    expect(enters).toBeCloseTo(1, 4);
    expect(leaves).toBe(10);
    const [behind, none] = await cone([-5, 0, 2], [1, 0, 0]); // behind the apex
    expect(behind).toBeGreaterThan(none);
  });

  it("weight the disc from 1 within its inner radius to 0 beyond its outer one", async () => {
    const weigh = async (degrees: number) => {
      const at = (degrees * Math.PI) / 180;
      const p = vec(3 * Math.sin(at), 0, -3 * Math.cos(at));
      const [inner, outer] = [10, 20].map((deg) => Math.cos((deg * Math.PI) / 180));
      const call = `oColor = vec4(discWeight(${p}, vec3(0.0), vec3(0.0, 0.0, -1.0),
        ${vec(inner, outer)}));`;
      return (await run(["focus_disc"], "", call))[0];
    };
    expect(await weigh(0)).toBe(1);
    expect(await weigh(9.9)).toBe(1);
    expect(await weigh(20.1)).toBe(0);
    const between = [await weigh(12), await weigh(15), await weigh(18)];
    expect(between).toEqual([...between].sort((a, b) => b - a));
    expect(between[0]).toBeLessThan(1);
    expect(between[2]).toBeGreaterThan(0);
  });

  it("weight channels that are not limited to the disc fully, others by the cube of the disc's weight", async () => {
    const head = `const vec3 uApex = vec3(0.0); const vec3 uAxis = vec3(0.0, 0.0, -1.0);
      const vec2 uDisc = vec2(0.99, 0.9); const float uPresence = 0.5; const bool uIsCrossing = false;
      const bvec4 uInDisc = bvec4(true, false, true, false);`;
    const far = await run(
      ["focus_disc", "disc_weights"],
      head,
      "oColor = weights(vec3(5.0, 0.0, -1.0));",
    );
    expect(far).toEqual([0, 0.5, 0, 0.5]);
    const near = await run(
      ["focus_disc", "disc_weights"],
      head,
      "oColor = weights(vec3(0.0, 0.0, -1.0));",
    );
    expect(near).toEqual([0.5, 0.5, 0.5, 0.5]);
    // cosine 0.945: half-way, where smoothstep is one half
    const at = `vec3(${Math.sqrt(1 - 0.945 ** 2)}, 0.0, -0.945)`;
    const half = await run(["focus_disc", "disc_weights"], head, `oColor = weights(${at});`);
    expect(half[0]).toBeCloseTo(0.5 / 8, 4);
    const crossing = head.replace("uIsCrossing = false", "uIsCrossing = true");
    const far2 = "oColor = weights(vec3(5.0, 0.0, -1.0));";
    // the images are mixed later, so each is complete
    expect(await run(["focus_disc", "disc_weights"], crossing, far2)).toEqual([1, 1, 1, 1]);
  });

  it("decode encoded light to the same values", async () => {
    const light = [0.001, 0.2, 0.75] as const;
    const body = `oColor = vec4(decoded(encoded(${vec(...light)})), 1.0);`;
    const found = await run(["encode_srgb", "decode_srgb"], "", body);
    light.forEach((v, i) => {
      expect(found[i]).toBeCloseTo(v, 3);
    });
  });

  it("mix the surrounding marched pixels by nearness, except those at another depth", async () => {
    // two pixels of the march for four pixels of the frame
    const chunks = await readChunks("marched_light");
    const text = chunks["chunks/marched_light"]
      .replace("uniform int uEyeCount;", "const int uEyeCount = 1;")
      .replace("uniform vec4 uEyes[2];", "vec4 uEyes[2];")
      .replace("uniform vec4 uParts[2];", "vec4 uParts[2];");
    const uMarched = {
      size: [2, 1],
      channels: 4,
      texels: [...[255, 0, 0, 255], 0, 0, 0, 0],
    } as const;
    const at = async (x: number, scene: readonly number[]) => {
      const body = `uEyes[0] = vec4(0.0, 0.0, 4.0, 1.0); uParts[0] = vec4(0.0, 0.0, 2.0, 1.0);
        oColor = marchedLight(vec2(${x.toFixed(1)}, 0.5));`;
      const uSceneDepth: Texture = { size: [4, 1], channels: 1, texels: [...scene] };
      const given = { uMarched: { ...uMarched, texels: [...uMarched.texels] }, uSceneDepth };
      const head = "#include <chunks/marched_light>";
      return runProgram(bare.page, { "chunks/marched_light": text }, head, body, given);
    };
    const even = [100, 100, 100, 100];
    expect((await at(0.5, even))[0]).toBeCloseTo(1, 2);
    expect((await at(1.5, even))[0]).toBeCloseTo(0.75, 2);
    expect((await at(2.5, even))[3]).toBeCloseTo(0.25, 2);
    expect((await at(2.5, [100, 100, 200, 200]))[0]).toBeLessThan(0.01); // across an edge
  });

  it("keep the hue of light that is too bright for the screen, and do not change other light", async () => {
    const within = (...light: number[]) =>
      run(["within_gamut"], "", `oColor = vec4(withinGamut(${vec(...light)}), 1.0);`);
    const [r, g, b] = await within(0.2, 1, 0.5);
    [0.2, 1, 0.5].forEach((v, i) => {
      expect([r, g, b][i]).toBeCloseTo(v, 5);
    });
    const bright = await within(3, 1.5, 0.3);
    expect(bright[0]).toBeCloseTo(1, 5);
    // the middle component keeps its relative place between the others
    expect((bright[1] - bright[2]) / (bright[0] - bright[2])).toBeCloseTo(1.2 / 2.7, 4);
    expect(bright[2]).toBeGreaterThan(0.1); // nearer to white than 0.3 / 3
  });

  it("encode colours as sRGB", async () => {
    const linear = [0.002, 0.2, 0.75] as const;
    const found = await run(["encode_srgb"], "", `oColor = vec4(encoded(${vec(...linear)}), 1.0);`);
    const hex = toHex(linear);
    [1, 3, 5].forEach((at, i) => {
      expect(255 * found[i]).toBeCloseTo(Number.parseInt(hex.slice(at, at + 2), 16), -0.5);
    });
  });

  it("return the clip plane through which a ray entered", async () => {
    const cut = async (planes: number[][], body: string, corner = Array(3).fill([0, 0, 0, 1])) => {
      const given = (plane: number[], i: number) => `uCutsGiven[${i}] = ${vec(...plane)};`;
      const bounds = corner.map((plane, i) => given(plane, 7 + i));
      const lines = [...planes.map(given), ...bounds].join("\n");
      const chunks = await readChunks("clip_planes");
      const text = chunks["chunks/clip_planes"]
        .replace("uniform vec4 uCuts[10];", "vec4 uCutsGiven[10];")
        .replace("uniform int uCutCount;", `const int uCutCount = ${planes.length};`)
        .replaceAll("uCuts[", "uCutsGiven[");
      return runProgram(
        bare.page,
        { "chunks/clip_planes": text },
        "#include <chunks/clip_planes>",
        `${lines}\n${body}`,
      );
    };
    const front = [0, 0, 1, 2]; // removes z > 2
    const isCut = (p: string) => cut([front], `oColor = vec4(isCut(${p}) ? 1.0 : 0.0);`);
    expect((await isCut("vec3(0.0, 0.0, 3.0)"))[0]).toBe(1);
    expect((await isCut("vec3(0.0, 0.0, 1.0)"))[0]).toBe(0);
    const octant = [
      [1, 0, 0, 0],
      [0, 1, 0, 0],
      [0, 0, 1, 0],
    ];
    const inCorner = (p: string) => cut([], `oColor = vec4(isCut(${p}) ? 1.0 : 0.0);`, octant);
    expect((await inCorner("vec3(1.0, 1.0, 1.0)"))[0]).toBe(1);
    expect((await inCorner("vec3(1.0, -1.0, 1.0)"))[0]).toBe(0);
    const right = [1, 0, 0, 1]; // removes x > 1
    const normal = (eye: string) =>
      cut([front, right], `oColor = vec4(cutNormal(${eye}, vec3(0.0)), 1.0);`);
    expect((await normal("vec3(0.0, 0.0, 9.0)")).slice(0, 3)).toEqual([0, 0, 1]);
    expect((await normal("vec3(9.0, 0.0, 1.0)")).slice(0, 3)).toEqual([1, 0, 0]);
    // The eye is on the kept side.
    expect((await normal("vec3(0.5, 0.0, 1.0)")).slice(0, 3)).toEqual([0, 0, 0]);
    // through both planes: the one that is crossed last
    expect((await normal("vec3(9.0, 0.0, 9.0)")).slice(0, 3)).toEqual([1, 0, 0]);
  });

  it("return the face through which a ray enters, of the box around all tiles or of a clip", async () => {
    const face = async (start: number[], plane = [0, 0, 0, 1]) => {
      const head = `const float uVoxel = 1.0; const vec4 uClipPlane = ${vec(...plane)};
        const vec3 uAllLow = vec3(-10.0, 0.0, 0.0); const vec3 uAllHigh = vec3(10.0);
        const vec3 uClipLow = vec3(-1e9); const vec3 uClipHigh = vec3(1e9, 1e9, 8.0);`;
      const body = `oColor = vec4(cutFace(${vec(...start)}), 1.0);`;
      return (await run(["cut_face"], head, body)).slice(0, 3);
    };
    expect(await face([10, 5, 5])).toEqual([1, 0, 0]);
    expect(await face([3, 0, 5])).toEqual([0, -1, 0]);
    expect(await face([3, 4, 8])).toEqual([0, 0, 1]); // the clip's face, inside the box
    expect(await face([0, 5, 5])).toEqual([0, 0, 0]); // where two tiles meet
    expect(await face([3, 4, 5], [0.6, 0.8, 0, 5])).toEqual([
      expect.closeTo(0.6),
      expect.closeTo(0.8),
      0,
    ]);
  });

  describe("find where the opaque scene ends a ray", () => {
    const [NEAR, FAR] = [1, 100];
    /** Distance of a fragment's point on the ray from the eye, and its view z. */
    const [BACK, VIEW_Z] = [13, -12];
    const VOXEL = 0.5;
    type Rect = readonly [number, number, number, number];

    /** Distance along the ray for a depth in the buffer, k of 255. */
    function distanceOf(k: number): number {
      const away = (NEAR * FAR) / (FAR - (k / 255) * (FAR - NEAR)); // along the view axis
      return (away * BACK) / -VIEW_Z;
    }

    /** Results of a fragment at `at` in a depth image, given row by row from below. */
    async function ends(
      depths: readonly (readonly number[])[],
      at: readonly [number, number],
      { eye, part }: Readonly<{ eye?: Rect; part?: Rect }> = {},
    ) {
      const size = [depths[0].length, depths.length];
      const whole = [0, 0, ...size];
      const x = -(FAR + NEAR) / (FAR - NEAR);
      const y = (-2 * FAR * NEAR) / (FAR - NEAR);
      const head = `uniform sampler2D uSceneDepth, uPaneDepth;
        const vec4 uEye = ${vec(...(eye ?? whole))}; const vec4 uPart = ${vec(...(part ?? whole))};
        const vec2 vDepth = ${vec(x, y)}; const float vViewZ = ${VIEW_Z.toFixed(1)};
        const float uVoxel = ${VOXEL}; const vec4 place = ${vec(...at, 0, 1)};
        #include <chunks/scene_distance>`;
      const chunks = await readChunks("scene_distance");
      const text = chunks["chunks/scene_distance"].replaceAll("gl_FragCoord", "place");
      const uSceneDepth = { size, channels: 1, texels: depths.flat() } as const;
      const uPaneDepth = { size, channels: 1, texels: depths.flat().map((k) => 255 - k) } as const;
      const back = BACK.toFixed(1);
      const body = `oColor = vec4(sceneDistances(${back}), paneDistance(${back}));`;
      const program = { "chunks/scene_distance": text };
      return runProgram(bare.page, program, head, body, { uSceneDepth, uPaneDepth });
    }

    const plain = (k: number) => [3, 3, 3].map((n) => new Array<number>(n).fill(k));
    const expectEnds = (found: readonly number[], near: number, far: number, share: number) => {
      expect(found[0] / near).toBeCloseTo(1, 4);
      expect(found[1] / far).toBeCloseTo(1, 4);
      expect(found[2]).toBe(share);
    };

    it("by the projection's own depth, along a ray that is not an axis", async () => {
      for (const k of [0, 128, 250, 255]) {
        const d = distanceOf(k);
        expectEnds(await ends(plain(k), [1.5, 1.5]), d, d, 0);
      }
      expect(distanceOf(255)).toBeCloseTo((FAR * 13) / 12, 6); // empty pixels are far away
      expect(distanceOf(0)).toBeCloseTo((NEAR * 13) / 12, 6);
    });

    it("with a silhouette's other side, and the share of the pixel that sees it", async () => {
      const picture = (...aside: readonly number[]) => {
        const [left, right, below, above] = aside;
        return [
          [255, below, 255],
          [left, 200, right],
          [255, above, 255],
        ];
      };
      const [near, far] = [distanceOf(200), distanceOf(255)];
      const at = (...aside: readonly number[]) => ends(picture(...aside), [1.5, 1.5]);
      for (const aside of [
        [255, 200, 200, 200],
        [200, 255, 200, 200],
        [200, 200, 255, 200],
        [200, 200, 200, 255],
      ]) {
        expectEnds(await at(...aside), near, far, 0.5);
      }
      expectEnds(await at(255, 200, 255, 200), near, far, 1);
      expectEnds(await at(255, 255, 255, 255), near, far, 1);
      expectEnds(await at(200, 240, 255, 200), near, far, 1); // the farthest neighbour counts
      expectEnds(await at(200, 255, 240, 200), near, far, 1);
      expectEnds(await at(100, 100, 100, 100), near, near, 0); // neighbouring pixels nearer to the eye do not count
    });

    it("and does not take the slope of one surface for a silhouette", async () => {
      const [k, jump] = [200, 4 * VOXEL];
      const beside = (other: number) => ends([[k, other]], [0.5, 0.5]);
      const firstJump = Array.from({ length: 256 }, (_, i) => i).findIndex(
        (i) => distanceOf(i) >= distanceOf(k) + jump,
      );
      expectEnds(await beside(firstJump - 1), distanceOf(k), distanceOf(k), 0);
      expectEnds(await beside(firstJump), distanceOf(k), distanceOf(firstJump), 0.5);
    });

    it("without reading the other eye's image", async () => {
      const row = [200, 200, 200, 200, 255, 255, 255, 255];
      const left = { eye: [0, 0, 4, 1], part: [0, 0, 4, 1] } as const;
      expectEnds(await ends([row], [3.5, 0.5], left), distanceOf(200), distanceOf(200), 0);
      const right = { eye: [4, 0, 4, 1], part: [4, 0, 4, 1] } as const;
      expectEnds(
        await ends([row.reverse()], [4.5, 0.5], right),
        distanceOf(200),
        distanceOf(200),
        0,
      );
    });

    it("at the eye's own pixels, if the march has fewer pixels than the frame", async () => {
      const row = [10, 20, 30, 40, 150, 160, 170, 180];
      const picture = [row.map((k) => k + 5), row];
      const right = { eye: [4, 0, 4, 2], part: [2, 0, 2, 1] } as const; // half as many
      const near = async (x: number) => (await ends(picture, [x, 0.5], right))[0];
      expect((await near(2.5)) / distanceOf(160)).toBeCloseTo(1, 4);
      expect((await near(3.5)) / distanceOf(180)).toBeCloseTo(1, 4);
      const pane = (await ends(picture, [2.5, 0.5], right))[3];
      expect(pane / distanceOf(255 - 160)).toBeCloseTo(1, 4);
    });
  });

  it("interpolate between voxels, and mix in a new level", async () => {
    const values = (add: number) =>
      Array.from({ length: 8 }, (_, i) => [20 * i + add, 255 - 20 * i, i % 2 ? 255 : 0, 7]).flat();
    const volume = (add: number): Texture => ({
      size: [2, 2, 2],
      channels: 4,
      texels: values(add),
      isLinear: true,
    });
    const sample = (at: readonly number[], fresh: number) =>
      run(
        ["sample_intensities"],
        `${fresh < 1 ? "#define FADES" : ""}
         uniform sampler3D uVolume; uniform sampler3D uOldVolume;
         const float uFresh = ${fresh.toFixed(3)};`,
        // the centres of voxels lie at 1/4 and 3/4
        `oColor = 255.0 * sampleIntensities(${vec(...at.map((v) => 0.25 + v / 2))});`,
        { uVolume: volume(100), uOldVolume: volume(0) },
      );
    for (const at of [
      [0, 0, 0],
      [1, 0, 1],
      [0.25, 0.5, 0.75],
      [0.5, 0, 0],
      [-0.5, 2, 0.5], // beyond the centre of the last voxel its value is used
    ]) {
      const [x, y, z] = at.map((v) => Math.min(1, Math.max(0, v)));
      const index = x + 2 * y + 4 * z;
      const fresh = [100 + 20 * index, 255 - 20 * index, 255 * x, 7];
      (await sample(at, 1)).forEach((v, i) => {
        expect(Math.abs(v - fresh[i]), `${at}`).toBeLessThan(1);
      });
      (await sample(at, 0.25)).forEach((v, i) => {
        expect(Math.abs(v - (i === 0 ? fresh[0] - 75 : fresh[i])), `${at}`).toBeLessThan(1);
      });
    }
  });

  describe("shade a sample", () => {
    /** A lamp and a uniform sky, in grey, and the shares of both that reach the place. */
    const lights = (key: number, even: number, gloss = 0, reaches = "1.0") => `
      vec2 reached(vec3 um, vec3 outwards) { return vec2(${reaches}); }
      const vec3 uKeyLight = vec3(${key.toFixed(4)}); const vec3 uFillLight = vec3(0.0);
      const vec3 uSkyLight = vec3(${even.toFixed(4)}); const vec3 uGroundLight = uSkyLight;
      const vec3 vFill = vec3(1.0, 0.0, 0.0); const vec3 vUp = vec3(0.0, 1.0, 0.0);
      const float uGloss = ${gloss.toFixed(4)};`;

    /**
     * Shades an intensity that rises by `slope` per um, in two channels, with voxels of 0.5 x 0.75
     * x 2 um whose rows run against y, as in a tile.
     */
    function lit(
      slope: readonly number[],
      dir: readonly number[],
      light: readonly number[],
      gloss = 0,
    ) {
      const size = [40, 60, 24]; // um
      const perUm = [1 / size[0], -1 / size[1], 1 / size[2]];
      const head = `const float uVoxel = 0.5; const vec3 vLight = ${vec(...unit(light))};
        ${lights(DIFFUSE, AMBIENT, gloss)}
        vec4 sampleIntensities(vec3 p) {
          vec3 um = (p - vec3(0.0, 1.0, 0.0)) * ${vec(...perUm.map((v) => 1 / v))};
          float v = dot(um - vec3(20.0, 30.0, 12.0), ${vec(...slope)});
          return vec4(0.5 + v, 0.5 - v, 0.5 + v, 0.0);
        }`;
      const shares = "vec4(0.25, 0.0, 0.75, 0.0)"; // the second channel has no weight
      const call = `shadeBy(vec3(1.0), gradientAt(vec3(0.5), ${vec(...perUm)}, ${shares}), lightAlong(${vec(...unit(dir))}), vec3(0.0))`;
      const body = `oColor = vec4(${call}, 1.0);`;
      return run(["gradient", "shade"], head, body).then(([found]) => found);
    }

    const unit = (v: readonly number[]) => v.map((each) => each / Math.hypot(...v));
    const dot = (a: readonly number[], b: readonly number[]) =>
      a.reduce((sum, v, i) => sum + v * b[i], 0);
    const [AMBIENT, DIFFUSE] = [0.4, 0.7];

    it("by the ramp's own direction, for any shape of the voxels", async () => {
      const [dir, light] = [
        [0.1, -0.2, -1],
        [-0.35, 0.5, 0.8],
      ];
      for (const slope of [
        [0.3, 0, 0],
        [0, 0.3, 0],
        [0, 0, 0.3],
        [0.2, -0.3, 0.1],
        [-0.2, 0.25, -0.4],
      ]) {
        const outwards = unit(slope.map((v) => -v)); // from large to small values
        const normal = dot(outwards, dir) > 0 ? outwards.map((v) => -v) : outwards;
        const expected = AMBIENT + DIFFUSE * Math.max(0, dot(normal, unit(light)));
        expect(await lit(slope, dir, light), `${slope}`).toBeCloseTo(expected, 3);
      }
    });

    it("by the angle: fully towards the lamp, half at 60 degrees, not at all from behind", async () => {
      const facing = (degrees: number) => {
        const at = (degrees * Math.PI) / 180;
        return lit([0, 0, -0.5], [0, 0, -1], [Math.sin(at), 0, Math.cos(at)]);
      };
      expect(await facing(0)).toBeCloseTo(AMBIENT + DIFFUSE, 4);
      expect(await facing(60)).toBeCloseTo(AMBIENT + DIFFUSE / 2, 4);
      expect(await facing(100)).toBeCloseTo(AMBIENT, 4);
    });

    it("without direction where the gradient is zero or noise, and gradually in between", async () => {
      // The lamp is beside the eye and behind the boundary, which would be dark.
      // The direction is slightly off the axis, so that rounding does not decide the side.
      const edgewise = [-1e-5, 0, -1];
      const steep = (step: number) => lit([-step, 0, 0], edgewise, [-1, 0, 1]); // over 1 um
      const even = 1.2 * (AMBIENT + DIFFUSE * Math.SQRT1_2); // the light on a boundary that faces the eye
      expect(await steep(0)).toBeCloseTo(even, 4);
      expect(await steep(0.03)).toBeCloseTo(even, 4);
      expect(await steep(0.105)).toBeCloseTo((even + AMBIENT) / 2, 3); // half-way
      expect(await steep(0.18)).toBeCloseTo(AMBIENT, 4);
    });

    it("with a highlight where the boundary mirrors the lamp", async () => {
      const facing = (degrees: number) => {
        const at = (degrees * Math.PI) / 180;
        return lit([0, 0, -0.5], [0, 0, -1], [Math.sin(at), 0, Math.cos(at)], 0.5);
      };
      expect(await facing(0)).toBeCloseTo(AMBIENT + 1.5 * DIFFUSE, 4);
      const half = Math.cos(Math.PI / 6) ** 16; // between lamp and eye
      expect(await facing(60)).toBeCloseTo(AMBIENT + DIFFUSE * (0.5 + 0.5 * half), 4);
    });

    it("by the shares of the sky and of the lamp that reach its place", async () => {
      const lit = async (reaches: string) => {
        const head = `const float uVoxel = 1.0; const vec3 vLight = vec3(0.0, 0.0, 1.0);
          ${lights(DIFFUSE, AMBIENT, 0, reaches)}
          vec4 sampleIntensities(vec3 p) { return vec4(0.0); }`;
        // a boundary that faces lamp and eye, and a place without a boundary
        const call = (slope: string) =>
          `shadeBy(vec3(1.0), vec3(0.0, 0.0, ${slope}), lightAlong(vec3(0.0, 0.0, -1.0)), vec3(0.0)).r`;
        const body = `oColor = vec4(${call("-0.5")}, ${call("0.0")}, 0.0, 1.0);`;
        return (await run(["gradient", "shade"], head, body)).slice(0, 2);
      };
      for (const [sky, lamp] of [
        [1, 1],
        [0.25, 1],
        [1, 0.25],
        [0.5, 0],
      ]) {
        const expected = sky * AMBIENT + lamp * DIFFUSE;
        const [boundary, even] = await lit(`${sky.toFixed(2)}, ${lamp.toFixed(2)}`);
        expect(boundary).toBeCloseTo(expected, 4);
        expect(even).toBeCloseTo(1.2 * expected, 4);
      }
    });

    it("by the shading one cell further out, weighted by its strength", async () => {
      // 4 cells of 2 um along x; sky and lamp in the first two channels
      const uReached: Texture = {
        size: [4, 1, 1],
        channels: 4,
        texels: [0, 255, 0, 0, 51, 204, 0, 0, 102, 153, 0, 0, 255, 255, 0, 0],
        isLinear: true,
      };
      const reached = async (x: number, outwards: string, strength: number) => {
        const head = `#define SHADED
          uniform sampler3D uReached; const float uShadingCell = 2.0;
          const mat4 uToShading = mat4(0.125, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0,
                                       0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
          const float uDepthShading = ${strength.toFixed(2)};`;
        const body = `oColor = reached(vec3(${x.toFixed(1)}, 0.5, 0.5), ${outwards}).xyxy;`;
        return (await run(["depth_shading"], head, body, { uReached })).slice(0, 2);
      };
      const expectAt = (found: readonly number[], sky: number, lamp: number) => {
        expect(found[0]).toBeCloseTo(sky, 2);
        expect(found[1]).toBeCloseTo(lamp, 2);
      };
      expectAt(await reached(3, "vec3(0.0)", 1), 1.1 * 0.2, 1.1 * 0.8);
      expectAt(await reached(3, "vec3(1.0, 0.0, 0.0)", 1), 1.1 * 0.4, 1.1 * 0.6);
      expectAt(await reached(3, "vec3(0.0)", 0.5), 0.5 + 0.55 * 0.2, 0.5 + 0.55 * 0.8);
      expect(await reached(3, "vec3(0.0)", 0)).toEqual([1, 1]); // exactly as without shading
    });

    it("by the volume's own texels too", async () => {
      // 8 x 8 x 4 voxels: rises by 16 of 255 per voxel along x, and by half of that along the rows
      const texels = Array.from({ length: 256 }, (_, i) => 16 * (i % 8) + 8 * ((i >> 3) % 8));
      const uVolume: Texture = { size: [8, 8, 4], channels: 1, texels, isLinear: true };
      const light = unit([-1, 1, 1]);
      const head = `uniform sampler3D uVolume;
        const float uVoxel = 1.0; const vec3 vLight = ${vec(...light)};
        ${lights(DIFFUSE, AMBIENT)}`;
      // voxels of 1 um; rows run against y
      const perUm = vec(1 / 8, -1 / 8, 1 / 4);
      const shares = "vec4(1.0, 0.0, 0.0, 0.0)";
      const call = `shadeBy(vec3(1.0), gradientAt(vec3(0.5), ${perUm}, ${shares}), lightAlong(vec3(0.6, -0.8, 0.0)), vec3(0.0))`;
      const textures = { uVolume };
      const [found] = await run(
        ["sample_intensities", "gradient", "shade"],
        head,
        `oColor = vec4(${call}, 1.0);`,
        textures,
      );
      const normal = unit([-2, 1, 0]);
      const steepness = (Math.hypot(16, 8) * 2) / 255;
      const t = (steepness - 0.03) / 0.15;
      const share = t * t * (3 - 2 * t);
      const even = 1.2 * (AMBIENT + DIFFUSE * Math.max(0, dot([-0.6, 0.8, 0], light)));
      const boundary = AMBIENT + DIFFUSE * Math.max(0, dot(normal, light));
      const expected = even + share * (boundary - even);
      expect(found).toBeCloseTo(expected, 2);
    });
  });

  describe("shift samples", () => {
    const size = [NOISE_SIZE, NOISE_SIZE];
    const noise: Texture = { size, channels: 1, texels: [...blueNoise()] };

    /**
     * The shift that the march itself computes at a pixel of the frame, of which an eye has a part.
     */
    async function shiftAt(
      at: readonly number[],
      corner: readonly number[],
      texture = noise,
      phase = 0,
    ) {
      const march = new URL("../../src/volumes/shaders/raymarch.frag.glsl", import.meta.url);
      const call = /float shift = (jitter\(.*\));/.exec(await readFile(march, "utf8"))?.[1];
      if (call === undefined) throw new Error("the march has no shift");
      const head = `uniform sampler2D uNoise; const float uPhase = ${phase.toFixed(4)};
        const vec4 place = ${vec(...at, 0, 1)};
        const vec4 uPart = ${vec(...corner, 9, 9)};`;
      const body = `oColor = vec4(${call.replaceAll("gl_FragCoord", "place")});`;
      return (await run(["jitter"], head, body, { uNoise: texture }))[0];
    }

    it("by another value in each frame, within the same step", async () => {
      const [first, next] = [
        await shiftAt([3, 1], [0, 0]),
        await shiftAt([3, 1], [0, 0], noise, 0.9),
      ];
      expect(next).toBeCloseTo((first + 0.9) % 1, 4);
    });

    it("by the value of the repeating table at the pixel", async () => {
      for (const [x, y] of [
        [0, 0],
        [3, 1],
        [NOISE_SIZE - 1, 5],
        [NOISE_SIZE + 2, 3 * NOISE_SIZE + 7],
      ]) {
        const value = noise.texels[(y % NOISE_SIZE) * NOISE_SIZE + (x % NOISE_SIZE)];
        expect(await shiftAt([x + 0.5, y + 0.5], [0, 0])).toBeCloseTo((value + 0.5) / 256, 5);
      }
    });

    it("by less than a step, and never by zero", async () => {
      const ends: Texture = { size: [2, 1], channels: 1, texels: [0, 255] };
      expect(await shiftAt([0.5, 0.5], [0, 0], ends)).toBeGreaterThan(0);
      expect(await shiftAt([1.5, 0.5], [0, 0], ends)).toBeLessThan(1);
    });

    it("equally for both eyes at the same place", async () => {
      const found: number[] = [];
      for (const [x, y] of [
        [0.5, 0.5],
        [17.5, 42.5],
        [100.5, 3.5],
      ]) {
        const left = await shiftAt([x, y], [0, 0]);
        found.push(left);
        // the right eye's part begins where the left eye's ends, which is not a multiple of the
        // table
        expect(await shiftAt([x + 213, y], [213, 0])).toBe(left);
        expect(await shiftAt([x + 213, y + 5], [213, 5])).toBe(left);
      }
      expect(new Set(found).size).toBeGreaterThan(1);
    });
  });

  it("classify one channel between two entries of its table", async () => {
    const texels = Array.from({ length: 256 }, (_, i) => [
      255,
      255,
      255,
      i === 101 ? 51 : 0,
    ]).flat();
    const uLut: Texture = { size: [256, 1], channels: 4, texels, isLinear: true };
    const head = `uniform sampler2D uLut;
      #define CHANNELS 1
      const vec3 uColor[1] = vec3[1](vec3(0.2, 0.4, 0.8));`;
    const at = async (intensity: number, voxels: number) =>
      run(
        ["classify"],
        head,
        `vec4 shares;
         oColor = classify(${vec(intensity / 255, 0, 0, 0)}, ${vec(voxels, 0, 0, 0)}, shares);`,
        { uLut },
      );
    expect((await at(100, 1))[3]).toBeCloseTo(0, 2);
    for (const [intensity, opacity] of [
      [101, 0.2],
      [100.5, 0.1],
      [101.75, 0.05],
    ]) {
      const found = await at(intensity, 3);
      [0.2, 0.4, 0.8, 1 - (1 - opacity) ** 3].forEach((v, i) => {
        expect(Math.abs(found[i] - v), `${intensity}`).toBeLessThan(0.01);
      });
    }
  });

  it("end an empty block earlier where a coarse level is blurred", async () => {
    const uOccupancy: Texture = { size: [8, 1, 1], channels: 1, texels: [7, 6, 5, 4, 3, 2, 1, 0] };
    const ahead = (slack: number, start: number) =>
      run(
        ["skip_empty_bricks"],
        `uniform sampler3D uOccupancy; const float uVoxel = 1.0;
         const float uBrickSlack = ${slack.toFixed(1)};`,
        `BrickRay ray = brickRay(vec3(${start.toFixed(2)}, 0.5, 0.5), vec3(1.0, 1e-9, 1e-9));
         oColor = blockAhead(ray, 0.0).xyxy;`,
        { uOccupancy },
      );
    // Two bricks before the visible one, which is brick 7. Near it, all values may be blurred.
    for (const [slack, start, exit, isEmpty] of [
      [0, 2.5, 4.5, 1],
      [2, 2.5, 2.5, 1],
      [2, 5.5, 0.5, 0],
      [1, 6.5, 0.5, 0],
    ]) {
      const [found, empty] = await ahead(slack, start);
      expect(found, `${slack}, ${start}`).toBeCloseTo(exit + 1e-3, 4);
      expect(empty).toBe(isEmpty);
    }
  });

  it("measure the angle from the lens's middle, and skip blocks beyond 25 degrees", async () => {
    // a part of 40 x 20 pixels from (10, 0); the eye's axis is at a quarter of its width
    const part = vec(10, 0, 40, 20);
    const at = async (x: number, y: number) => {
      const body = `ivec2 pixel = ivec2(${x}, ${y});
        oColor = vec4(tangentAt(vec2(pixel), ${part}), shareOfSteps(vec2(pixel), ${part}),
          isSparse(pixel, ${part}), isLeftOut(pixel, ${part}));`;
      return run(["periphery"], "", body, { uLens: [2, 1, 1, 0] });
    };
    expect(await at(20, 10)).toEqual([0, 1, 0, 0].map((v) => expect.closeTo(v, 5)));
    const [tangent, share] = await at(30, 10); // half of clip space to the side: 45 degrees
    expect(tangent).toBeCloseTo(1, 5);
    expect(share).toBeCloseTo(0.5, 5);
    const blocks = [];
    for (const x of [30, 31, 32, 33]) blocks.push((await at(x, 10))[3]);
    expect(blocks).toEqual([0, 0, 1, 1]);
  });

  it("find the face through which a ray to a surface leaves the open tile", async () => {
    // the tile is the box from -1 to 1
    const outwards = [0, 1, 2].flatMap((axis) =>
      [1, -1].map((side) => [0, 1, 2].map((k) => (k === axis ? side : 0))),
    );
    const planes = outwards.flatMap((normal) => [...normal, 1]);
    const normalAt = async (eye: number[], p: number[], uOpen = planes) => {
      const body = `oColor = vec4(openNormal(${vec(...eye)}, ${vec(...p)}), 0.0);`;
      return (await run(["open_tile"], "", body, { uOpen })).slice(0, 3);
    };
    const eye = [0, 0, 5];
    expect(await normalAt(eye, [0, 0, -1])).toEqual([0, 0, 1]); // exactly in the far face
    expect(await normalAt(eye, [0, 0, -3])).toEqual([0, 0, 1]);
    expect(await normalAt(eye, [1.6, 0, -3])).toEqual([-1, 0, 0]); // leaves through a side
    expect(await normalAt([0, 0, 0], [0, 3, 0])).toEqual([0, -1, 0]); // from inside
    expect(await normalAt(eye, [0, 0, 0])).toEqual([0, 0, 0]); // ends inside
    expect(await normalAt(eye, [2, 0, -1])).toEqual([0, 0, 0]); // passes beside the tile
    expect(await normalAt(eye, [0, 0, 2])).toEqual([0, 0, 0]); // ends in front of the tile
    expect(await normalAt(eye, [0, 0, -3], new Array<number>(24).fill(0))).toEqual([0, 0, 0]);
  });

  it("put each instance of a scene into its eye's part of the frame", async () => {
    const chunks = await readChunks("both_eyes_vertex");
    const drawn = async (isForBoth: boolean, eye: number) => {
      const text = chunks["chunks/both_eyes_vertex"]
        .replace("varying float vEye;", "float vEye;")
        .replace("uniform bool uIsForBoth;", `const bool uIsForBoth = ${isForBoth};`)
        .replace("uniform mat4 uEyeClip[2];", "mat4 uEyeClip[2] = mat4[2](mat4(2.0), mat4(3.0));")
        .replaceAll("gl_InstanceID", `${eye}`)
        .replaceAll("gl_Position", "place");
      const body = "toEachEye(vec4(1.0)); oColor = vec4(place.xy, vEye, 0.0);";
      return runProgram(bare.page, {}, `vec4 place = vec4(7.0);\n${text}`, body);
    };
    expect(await drawn(false, 1)).toEqual([7, 7, -1, 0]);
    expect(await drawn(true, 0)).toEqual([2, 2, 0, 0]);
    expect(await drawn(true, 1)).toEqual([3, 3, 1, 0]);
  });

  it("keep a fragment in its own eye's part of the frame", async () => {
    const chunks = await readChunks("both_eyes_fragment");
    /**
     * Mean of two pixels, 0.5 and 1.5, where the right one begins the right eye's part; a discarded
     * pixel counts as 0.
     */
    const mean = async (eye: number) => {
      const text = chunks["chunks/both_eyes_fragment"]
        .replace("varying float vEye;", `const float vEye = ${eye.toFixed(1)};`)
        .replace("uniform float uMiddle;", "const float uMiddle = 1.0;");
      const body = "keepToOwnEye(); oColor = vec4(gl_FragCoord.x);";
      return (await runProgram(bare.page, {}, text, body, {}, 2))[0];
    };
    expect(await mean(0)).toBe(0.25);
    expect(await mean(1)).toBe(0.75);
    expect(await mean(-1)).toBe(1);
  });

  it("leave the share of a surface that its volume does not replace", async () => {
    const [focus, share] = ["focus_disc", "surface_share"];
    const chunks = await readChunks(focus, share);
    const left = async (taken: number, isInDisc: boolean, crosses: boolean, x = 0) => {
      const text = chunks[`chunks/${share}`].replace(/^uniform .*$/gm, "");
      const head = `const vec2 uDisc = vec2(0.99, 0.9); const vec3 uApex = vec3(0.0);
        const vec3 uAxis = vec3(0.0, 0.0, -1.0); const float uOpacity = 1.0;
        const float uTaken = ${taken.toFixed(2)}; const bool uInDisc = ${isInDisc};
        const bool uCrosses = ${crosses};\n${chunks[`chunks/${focus}`]}\n${text}`;
      const at = vec(x, 0, -1);
      const body = `oColor = vec4(shareTaken(${at}), isGone(${at}) ? 1.0 : 0.0, 0.0, 0.0);`;
      return (await runProgram(bare.page, {}, head, body)).slice(0, 2);
    };
    expect(await left(0.25, false, false)).toEqual([0.25, 0]);
    expect(await left(1, false, false)).toEqual([1, 1]);
    expect(await left(1, false, true)).toEqual([1, 0]); // mixed with the volume's image
    expect(await left(1, true, false)).toEqual([1, 1]);
    expect(await left(1, true, false, 5)).toEqual([0, 0]); // outside the disc
  });

  it("know what a rough surface reflects about as well as three.js's table", async () => {
    // @ts-expect-error three.js has no types for this file
    const { getDFGLUT } = await import("three/src/renderers/shaders/DFGLUTData.js");
    const { width, height, data } = getDFGLUT().image;
    // the table's entries lie at the middles of its cells
    for (let i = width / 2; i < width; i++) {
      for (let j = 0; j < height; j += 3) {
        const at = vec((i + 0.5) / width, (j + 0.5) / height);
        const found = await run(["reflected_share"], "", `oColor = reflectedShare(${at}).xyxy;`);
        const entry = [0, 1].map((k) => DataUtils.fromHalfFloat(data[2 * (j * width + i) + k]));
        expect(Math.abs(found[0] - entry[0]), at).toBeLessThan(0.045);
        expect(Math.abs(found[1] - entry[1]), at).toBeLessThan(0.011);
      }
    }
  });

  it("are all tested", async () => {
    const tests = [
      "raymarch_chunks.test.ts",
      "path_trace_chunks.test.ts",
      "raymarch.test.ts",
      "transfer_2d.test.ts",
    ].map((name) => readFile(new URL(name, import.meta.url), "utf8"));
    const text = (await Promise.all(tests)).join("\n");
    const names = await readdir(new URL("../../src/gpu/chunks/", import.meta.url));
    for (const name of names) expect(text).toContain(`"${name.replace(".glsl", "")}"`);
  });
});
