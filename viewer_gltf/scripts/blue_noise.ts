/**
 * Makes a tile of blue noise by the method of void and cluster. Texels are ranked so that the texels below any threshold
 * are spread as evenly as possible, also across the tile's edges. Writes src/gpu/blue_noise.ts, which is the same each
 * time:
 *
 *   npx tsx scripts/blue_noise.ts
 *
 * Reference: Ulichney, The void-and-cluster method for dither array generation, SPIE 1913, 1993.
 */
import { writeFile } from "node:fs/promises";
import { fileURLToPath } from "node:url";
import { seeded } from "../test/support/seeded";

const SIZE = 64;
const SEED = 1993;
/** Sigma of the Gaussian in texels; Ulichney's choice. */
const SIGMA = 1.5;
/** Share of the texels that are marked in the first pattern. */
const FIRST_SHARE = 0.1;
const LINE = 88;

/** Marked texels of a tile, and the density at every texel: the sum of a Gaussian around each marked one. */
class Pattern {
  readonly isMarked: Uint8Array;
  private readonly crowd: Float64Array;
  private readonly kernel: Float64Array;

  constructor(private readonly size: number) {
    this.isMarked = new Uint8Array(size * size);
    this.crowd = new Float64Array(size * size);
    const distance = (i: number) => Math.min(i, size - i);
    this.kernel = Float64Array.from({ length: size * size }, (_, i) => {
      const r2 = distance(i % size) ** 2 + distance(Math.floor(i / size)) ** 2;
      return Math.exp(-r2 / (2 * SIGMA ** 2));
    });
  }

  set(at: number, marked: 0 | 1): void {
    const { size, crowd, kernel } = this;
    this.isMarked[at] = marked;
    const sign = marked === 1 ? 1 : -1;
    const [ax, ay] = [at % size, Math.floor(at / size)];
    for (let y = 0; y < size; y++) {
      const row = ((y - ay + size) % size) * size;
      for (let x = 0; x < size; x++) {
        crowd[y * size + x] += sign * kernel[row + ((x - ax + size) % size)];
      }
    }
  }

  /** Returns the marked texel with the highest density (`cluster`) or the unmarked one with the lowest (`void`). */
  extreme(kind: "cluster" | "void"): number {
    const [marked, sign] = kind === "cluster" ? [1, 1] : [0, -1];
    let best = -1;
    for (let i = 0; i < this.crowd.length; i++) {
      if (this.isMarked[i] !== marked) continue;
      if (best === -1 || sign * this.crowd[i] > sign * this.crowd[best]) best = i;
    }
    return best;
  }

  copy(): Pattern {
    const other = new Pattern(this.size);
    other.isMarked.set(this.isMarked);
    other.crowd.set(this.crowd);
    return other;
  }
}

/** Returns each texel's rank, 0 .. size^2 - 1, x fastest. */
export function voidAndCluster(size: number, seed: number): Uint16Array {
  const first = new Pattern(size);
  const random = seeded(seed);
  const count = Math.max(1, Math.floor(FIRST_SHARE * size * size));
  for (let marked = 0; marked < count; ) {
    const at = Math.floor(random() * size * size);
    if (first.isMarked[at] === 1) continue;
    first.set(at, 1);
    marked++;
  }
  // Moves the texel of the tightest cluster into the largest void until that changes nothing.
  for (;;) {
    const cluster = first.extreme("cluster");
    first.set(cluster, 0);
    const hole = first.extreme("void");
    first.set(hole, 1);
    if (hole === cluster) break;
  }

  const ranks = new Uint16Array(size * size);
  const thinned = first.copy();
  for (let rank = count - 1; rank >= 0; rank--) {
    const at = thinned.extreme("cluster");
    thinned.set(at, 0);
    ranks[at] = rank;
  }
  // When more than half of the texels are marked, Ulichney looks for the tightest cluster of unmarked ones. This is the
  // same texel as the largest void, since the Gaussians of all texels have the same sum everywhere.
  for (let rank = count; rank < size * size; rank++) {
    const at = first.extreme("void");
    first.set(at, 1);
    ranks[at] = rank;
  }
  return ranks;
}

/** Returns the ranks as 8-bit numbers; every value occurs equally often. */
export function blueNoiseTexels(): Uint8Array {
  const ranks = voidAndCluster(SIZE, SEED);
  return Uint8Array.from(ranks, (rank) => Math.floor((256 * rank) / ranks.length));
}

function moduleText(texels: Uint8Array): string {
  const base64 = Buffer.from(texels).toString("base64");
  const lines = base64.match(new RegExp(`.{1,${LINE}}`, "g")) ?? [];
  return `/** A tile of blue noise, made by scripts/blue_noise.ts: don't edit. */

/** Texels along each edge; the tile repeats without a seam. */
export const NOISE_SIZE = ${SIZE};

const BASE64 = [
${lines.map((line) => `  "${line}",`).join("\n")}
].join("");

/** Its texels, x fastest; each of the 256 values ${(SIZE * SIZE) / 256} times. */
export function blueNoise(): Uint8Array<ArrayBuffer> {
  return Uint8Array.from(atob(BASE64), (byte) => byte.charCodeAt(0));
}
`;
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const out = new URL("../src/gpu/blue_noise.ts", import.meta.url);
  await writeFile(out, moduleText(blueNoiseTexels()));
}
