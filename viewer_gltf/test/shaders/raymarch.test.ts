/** Tests of the ray march's numbers: how many steps a ray takes, and what its chunks compute. */
import { expect, it } from "vitest";
import { MAX_STEPS } from "../../src/voxels/march_frame";
import { prepareBarePage } from "../support/browser/bare_page";
import { describeInChromium } from "../support/browser/skip";
import { sweep } from "../support/exhaustive";
import { readChunks, runProgram } from "../support/shaders/chunk";
import type { Counts, Harness, Run } from "../support/shaders/harness";

describeInChromium("the ray march", () => {
  const bare = prepareBarePage<Harness>(new URL("../support/shaders/harness.ts", import.meta.url));

  async function count(run: Run): Promise<Counts> {
    const counts = await bare.call("countSteps", run);
    expect(counts.pixels).toBeGreaterThan(300);
    return counts;
  }

  it("takes at most 100 steps, and reaches the end", async () => {
    expect(MAX_STEPS).toBe(100);
    // The space diagonal is 337 voxels, which would be 481 steps of the shortest length.
    const { most, covered } = await count({ side: 198, opacity: 1, bricks: "all" });
    expect(most).toBeLessThanOrEqual(100);
    expect(most).toBeGreaterThan(90);
    expect(covered).toBeGreaterThan(0.99);
  });

  it("stays within the limit if skips and samples alternate", async () => {
    const { most, covered } = await count({ side: 198, opacity: 1, bricks: "checkerboard" });
    expect(most).toBeLessThanOrEqual(100);
    expect(covered).toBeGreaterThan(0.99);
  });

  it("stops after an opaque first sample", async () => {
    const { most } = await count({ side: 198, opacity: 255, bricks: "all" });
    expect(most).toBeLessThanOrEqual(2);
  });

  it("skips empty space", async () => {
    const { most, covered } = await count({ side: 198, opacity: 255, bricks: "none" });
    expect(most).toBeLessThanOrEqual(5);
    expect(covered).toBeGreaterThan(0.99);
  });

  it("takes no more steps if a ray passes several tiles", async () => {
    for (const cubes of [2, 3, 7]) {
      const most = await bare.call("countThrough", { side: 51, opacity: 1, bricks: "all" }, cubes);
      expect(most).toBeLessThanOrEqual(MAX_STEPS);
      expect(most).toBeGreaterThan(0.8 * MAX_STEPS);
    }
  });

  it.each(["bricks", "cells"] as const)(
    "shows the same with and without skips of %s, for random volumes",
    async (skips) => {
      let drawn = 0;
      const seeds = sweep(
        Array.from({ length: 30 }, (_, i) => i),
        (seed) => seed < 10,
      );
      for (const seed of seeds) {
        const found = await bare.call("compareSkips", seed, skips);
        expect(found.apart, `seed ${seed}`).toBeLessThanOrEqual(1);
        drawn += found.drawn;
      }
      expect(drawn).toBeGreaterThan(seeds.length * 100);
    },
  );

  it.each(["bricks", "cells"] as const)(
    "shows as much of a thin sheet with skips of %s, if steps are long",
    async (skips) => {
      for (const thickness of [2, 4, 10]) {
        const plain = await bare.call("opacityOfSheet", null, thickness);
        const skipping = await bare.call("opacityOfSheet", skips, thickness);
        expect(plain).toBeGreaterThan(0.02);
        expect(Math.abs(skipping / plain - 1), `${thickness} voxels`).toBeLessThan(0.1);
      }
    },
  );

  it("mixes a volume that fades in with the one before it", async () => {
    const [before, half, after] = await Promise.all(
      [0, 0.5, 1].map((fresh) => bare.call("opacityWhileFading", fresh)),
    );
    expect(before).toBe(0);
    expect(half).toBeGreaterThan(0.3 * after);
    expect(half).toBeLessThan(0.8 * after);
  });

  it("gives a ramp the opacity of its integral", async () => {
    const [side, opacity] = [67, 20];
    // Transmittance is the product of (1 - a)^length, so its logarithm is an integral along the
    // ray.
    let log = 0;
    for (let i = 0; i < 10_000; i++) {
      log += Math.log(1 - ((opacity / 255) * (i + 0.5)) / 10_000);
    }
    const expected = 1 - Math.exp((log / 10_000) * (side - 3));
    const found = await bare.call("meanOpacity", "ramp", side, opacity);
    expect(Math.abs(found - expected)).toBeLessThan(2 / 255);
  });

  it("gives a uniform cube the opacity for its length, at any opacity", async () => {
    // 64 voxels take one step each; of 200, some steps are longer than a voxel and are corrected
    for (const side of [67, 203]) {
      for (const opacity of [1, 5, 20]) {
        const expected = 1 - (1 - opacity / 255) ** (side - 3);
        const found = await bare.call("meanOpacity", "uniform", side, opacity);
        const ends = expected > 0.99 ? 0.01 : 2 / 255; // rays end at this opacity
        expect(Math.abs(found - expected), `${side}, ${opacity}`).toBeLessThan(ends);
      }
    }
  });

  it("is unlit when the benchmark compares it with other programs", async () => {
    const through = (isUnlit: boolean) =>
      bare.call("meanAlong", "over", "uniform", 67, 20, [0, 1], isUnlit);
    const [[lit], [red, , , alpha]] = [await through(false), await through(true)];
    expect(red).toBeCloseTo(alpha, 2); // unshaded white
    expect(Math.abs(lit - alpha)).toBeGreaterThan(0.03);
  });

  it("finds the largest value along a ray, behind any others", async () => {
    const [red, , , alpha] = await bare.call("meanAlong", "maximum", "ramp", 67, 20);
    expect(red).toBeGreaterThan(0.97); // the last samples, just before 255
    expect(alpha).toBeCloseTo(red, 2);
  });

  it("shows the middle of a channel's window half as bright on the screen as its end", async () => {
    const [red] = await bare.call("meanAlong", "maximum", "uniform", 67, 255, [0, 2]);
    // Linear light of an sRGB value of one half.
    expect(red).toBeCloseTo(((0.5 + 0.055) / 1.055) ** 2.4, 2);
  });

  it("adds up values along a ray, without occlusion", async () => {
    // 4 for an opaque specimen, for any number of voxels; occlusion would give 0.98
    for (const side of [67, 35]) {
      const [red, , , alpha] = await bare.call("meanAlong", "sum", "uniform", side, 16);
      expect(red).toBeCloseTo((4 * 16) / 255, 2);
      expect(alpha).toBe(0); // the background is not attenuated
    }
  });

  it("averages images of a view at rest", async () => {
    const reds = Array.from({ length: 64 }, (_, i) => 0.5 + 0.25 * Math.sin(2.4 * i));
    const means = await bare.call("meansOf", reds);
    // Blended half floats are rounded, but Mesa's software renderer truncates them, which adds an
    // error of up to half a step for each image.
    const [stored] = await bare.call("meansOf", [0.7]);
    const step = stored < 0.7 ? 2 ** -11 : 0;
    for (const count of [1, 2, 9, 64]) {
      const expected = reds.slice(0, count).reduce((sum, red) => sum + red, 0) / count;
      expect(Math.abs(means[count - 1] - expected)).toBeLessThan(0.5 / 255 + (step * count) / 2);
    }
  });

  it("draws half of a lens's periphery, in fewer steps, and fills the rest", async () => {
    const pixels = await bare.call("sparsePixels");
    for (const eye of [0, 1]) {
      const mine = pixels.filter((pixel) => pixel.eye === eye);
      const middle = mine.filter(({ angle }) => angle < 19);
      expect(middle.length).toBeGreaterThan(500);
      expect(middle.every(({ isMarched, steps }) => isMarched && steps > 0.99)).toBe(true);
      const beside = mine.filter(({ angle }) => angle > 30);
      const share = beside.filter(({ isMarched }) => isMarched).length / beside.length;
      expect(Math.abs(share - 0.5)).toBeLessThan(0.02);
      const far = mine.filter(({ angle, isMarched }) => angle > 46 && isMarched);
      expect(far.length).toBeGreaterThan(100);
      expect(far.every(({ steps }) => Math.abs(steps - 0.5) < 0.01)).toBe(true);
      expect(Math.max(...middle.map(({ off }) => off))).toBeLessThan(0.1);
      expect(Math.max(...mine.map(({ off }) => off))).toBeLessThan(1.6);
    }
  });

  it("blends light across the border of two tiles as within one", async () => {
    const columns = await bare.call("columnsOverBorder");
    for (const k of [0, 1, 2]) {
      const values = columns.map((column) => column[k]);
      expect(Math.max(...values) - Math.min(...values)).toBeLessThan(3);
    }
    expect(columns[0][0]).toBeGreaterThan(60); // two tiles are visible
    expect(columns[0][1]).toBeGreaterThan(60);
  });

  it("finds where a ray enters and leaves a box", async () => {
    const chunks = await readChunks("intersect_box");
    const intersect = async (eye: string, dir: string) => {
      const box = "vec3(0.0), vec3(4.0, 2.0, 8.0)";
      const call = `intersectBox(vec3(${eye}), 1.0 / vec3(${dir}), ${box})`;
      const head = "#include <chunks/intersect_box>";
      return (await runProgram(bare.page, chunks, head, `oColor = ${call}.xyxy;`)).slice(0, 2);
    };
    // Along z, slightly off the axes, since the reciprocal of 0 is not defined in GLSL.
    const [near, far] = await intersect("1.0, 1.0, -5.0", "1e-7, 1e-7, 1.0");
    expect(near).toBeCloseTo(5, 4);
    expect(far).toBeCloseTo(13, 4);
    // Along the diagonal (1, 1, 1): in through y = 0, out through y = 2.
    expect(await intersect("0.0, -1.0, 0.0", "1.0, 1.0, 1.0")).toEqual([1, 3]);
    const [enters, leaves] = await intersect("9.0, 1.0, -5.0", "1e-7, 1e-7, 1.0");
    expect(enters).toBeGreaterThan(leaves); // the ray misses
  });

  it("finds the end of the empty block, and of a visible brick", async () => {
    const chunks = await readChunks("skip_empty_bricks");
    const head = `uniform sampler3D uOccupancy;
      const float uVoxel = 1.0;
      const float uBrickSlack = 0.0;
      #include <chunks/skip_empty_bricks>`;
    // 8 bricks in a row, the last one visible
    const uOccupancy = { size: [8, 1, 1], channels: 1, texels: [7, 6, 5, 4, 3, 2, 1, 0] } as const;
    const ahead = async (start: number, dir: number, t: number) =>
      (
        await runProgram(
          bare.page,
          chunks,
          head,
          `BrickRay ray = brickRay(vec3(${start.toFixed(3)}, 0.5, 0.5),
                                   vec3(${dir.toFixed(3)}, 1e-9, 1e-9));
           oColor = blockAhead(ray, ${t.toFixed(3)}).xyxy;`,
          { uOccupancy: { ...uOccupancy, texels: [...uOccupancy.texels] } },
        )
      ).slice(0, 2);
    const expectBlock = async (found: Promise<readonly number[]>, exit: number, empty: number) => {
      const [x, y] = await found;
      expect(x).toBeCloseTo(exit + 1e-3, 4);
      expect(y).toBe(empty);
    };
    await expectBlock(ahead(0.5, 1, 0), 6.5, 1); // from brick 0 to the boundary of brick 7
    await expectBlock(ahead(0.5, 1, 2), 6.5, 1); // t starts at the beginning of the ray
    await expectBlock(ahead(0.5, 0.5, 0), 13, 1);
    await expectBlock(ahead(7.5, 1, 0), 0.5, 0); // the visible brick's own end
    await expectBlock(ahead(6.5, -1, 0), 0.5, 1); // back from brick 6, whose block is that brick
  });

  it("classifies by the table, with the opacity for the step's length", async () => {
    const chunks = await readChunks("classify");
    const head = `uniform sampler2D uLut; uniform vec4 uAsked;
      #define CHANNELS 2
      const vec3 uColor[CHANNELS] = vec3[CHANNELS](vec3(1.0, 0.0, 0.0), vec3(0.0, 0.0, 1.0));
      #include <chunks/classify>`;
    const row = (top: number) =>
      Array.from({ length: 256 }, (_, i) => [255, 255, 255, i === 200 ? top : 0]).flat();
    const uLut = { size: [256, 2], channels: 4, texels: [...row(51), ...row(102)] } as const;
    const classify = (intensity: string, voxels: string, asksShares = 0) =>
      runProgram(
        bare.page,
        chunks,
        head,
        `vec4 shares; oColor = classify(vec4(${intensity}, 0.0, 0.0) / 255.0, vec4(${voxels}), shares);
         if (uAsked.x > 0.0) oColor = shares;`,
        { uLut: { ...uLut, texels: [...uLut.texels] }, uAsked: [asksShares, 0, 0, 0] },
      );
    const one = await classify("200.0, 0.0", "3.0");
    [1, 0, 0, 1 - 0.8 ** 3].forEach((v, i) => {
      expect(one[i]).toBeCloseTo(v, 5);
    });
    // Two channels absorb together, and share the colour 0.2 to 0.4.
    const both = await classify("200.0, 200.0", "1.0");
    [1 / 3, 0, 2 / 3, 1 - 0.8 * 0.6].forEach((v, i) => {
      expect(both[i]).toBeCloseTo(v, 5);
    });
    const shares = await classify("200.0, 200.0", "1.0", 1);
    [1 / 3, 2 / 3, 0, 0].forEach((v, i) => {
      expect(shares[i]).toBeCloseTo(v, 5);
    });
    expect((await classify("10.0, 0.0", "1.0"))[3]).toBe(0);
  });
});
