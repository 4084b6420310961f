import { describe, expect, it } from "vitest";
import { blueNoiseTexels, voidAndCluster } from "../../scripts/blue_noise";
import { seeded } from "../../test/support/seeded";
import { blueNoise, NOISE_SIZE } from "./blue_noise";

const N = NOISE_SIZE;

/**
 * Mean power of the frequencies below a share of the Nyquist frequency, except frequency 0, divided
 * by the mean power of all frequencies. White noise gives 1.
 */
function lowPower(texels: ArrayLike<number>, share: number): number {
  const cosine = Array.from({ length: N }, (_, i) => Math.cos((2 * Math.PI * i) / N));
  const sine = Array.from({ length: N }, (_, i) => Math.sin((2 * Math.PI * i) / N));
  const mean = Array.from(texels).reduce((sum, v) => sum + v, 0) / (N * N);
  const limit = (share * N) / 2;
  let power = 0;
  let count = 0;
  for (let v = -limit; v <= limit; v++) {
    for (let u = -limit; u <= limit; u++) {
      if ((u === 0 && v === 0) || Math.hypot(u, v) >= limit) continue;
      let [re, im] = [0, 0];
      for (let i = 0; i < N * N; i++) {
        const phase = (((u * (i % N) + v * Math.floor(i / N)) % N) + N) % N;
        re += (texels[i] - mean) * cosine[phase];
        im += (texels[i] - mean) * sine[phase];
      }
      power += re ** 2 + im ** 2;
      count++;
    }
  }
  // Parseval: the power of all N^2 frequencies is N^2 times the sum of squares.
  const all = Array.from(texels).reduce((sum, t) => sum + (t - mean) ** 2, 0);
  return power / count / all;
}

describe("the blue-noise tile", () => {
  const texels = blueNoise();

  it("has every value equally often", () => {
    const counts = new Array<number>(256).fill(0);
    for (const value of texels) counts[value]++;
    expect(texels).toHaveLength(N * N);
    expect(new Set(counts)).toEqual(new Set([16]));
  });

  it("has hardly any power at low frequencies, unlike white noise", () => {
    const random = seeded(11);
    const white = Uint8Array.from(texels, () => 256 * random());
    expect(lowPower(white, 0.25)).toBeGreaterThan(0.7);
    expect(lowPower(texels, 0.25)).toBeLessThan(0.05);
  });

  it("repeats without a seam: neighbours differ as much across its edges as inside", () => {
    const difference = (x: number, y: number) => {
      const at = texels[y * N + x];
      return [
        Math.abs(at - texels[y * N + ((x + 1) % N)]),
        Math.abs(at - texels[((y + 1) % N) * N + x]),
      ];
    };
    let [inside, seam] = [0, 0];
    for (let i = 0; i < N; i++) {
      seam += difference(N - 1, i)[0] + difference(i, N - 1)[1];
      for (let j = 0; j < N - 1; j++) inside += difference(j, i)[0] + difference(i, j)[1];
    }
    expect(Math.abs(seam / (2 * N) / (inside / (2 * N * (N - 1))) - 1)).toBeLessThan(0.15);
  });

  it("keeps the darkest texels apart, also across the edges", () => {
    // One texel in 16 is dark: 4 texels apart.
    const dark = [...texels.keys()].filter((i) => texels[i] < 16);
    const apart = (a: number, b: number) => {
      const wrap = (d: number) => Math.min(d, N - d);
      const dx = wrap(Math.abs((a % N) - (b % N)));
      return Math.hypot(dx, wrap(Math.abs(Math.floor(a / N) - Math.floor(b / N))));
    };
    const nearest = dark.map((a) =>
      Math.min(...dark.filter((b) => b !== a).map((b) => apart(a, b))),
    );
    expect(Math.min(...nearest)).toBeGreaterThan(2);
  });

  it("equals the result of the script", () => {
    expect(blueNoiseTexels()).toEqual(texels);
  });

  it("has ranks without gaps at any size and seed", () => {
    const ranks = [...voidAndCluster(12, 5)].sort((a, b) => a - b);
    expect(ranks).toEqual(Array.from({ length: 144 }, (_, i) => i));
  });
});
