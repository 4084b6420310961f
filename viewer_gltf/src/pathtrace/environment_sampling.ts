/**
 * Makes the tables by which the path tracer samples directions of an environment's light. They contain radiance and
 * probability density of each direction, and aliases (Walker 1977; built by the method of Vose 1991). Pure arrays.
 */

/** An environment map: rows of `width` RGB texels of linear radiance, top row first. */
export type Radiance = Readonly<{ width: number; height: number; rgb: Float32Array }>;

export type EnvironmentTables = Readonly<{
  width: number;
  height: number;
  /** RGB radiance and the density per steradian. */
  light: Float32Array<ArrayBuffer>;
  /** Probability to keep a texel, and the texel that is taken instead. */
  aliases: Float32Array<ArrayBuffer>;
  /** Mean radiance over all directions. */
  mean: readonly [number, number, number];
}>;

export function environmentTables({ width, height, rgb }: Radiance): EnvironmentTables {
  const count = width * height;
  if (rgb.length !== 3 * count || count === 0) {
    throw new RangeError(`expected ${3 * count} numbers of radiance, found ${rgb.length}`);
  }
  const weights = new Float64Array(count);
  const light = new Float32Array(4 * count);
  const mean: [number, number, number] = [0, 0, 0];
  let sum = 0;
  for (let i = 0; i < count; i++) {
    const row = Math.floor(i / width);
    const [top, bottom] = [row, row + 1].map((v) => Math.cos((v / height) * Math.PI));
    const solidAngle = ((top - bottom) * 2 * Math.PI) / width;
    const [r, g, b] = [0, 1, 2].map((k) => {
      const value = rgb[3 * i + k];
      return Number.isFinite(value) ? Math.max(0, value) : 0;
    });
    light.set([r, g, b, 0], 4 * i);
    for (const k of [0, 1, 2]) mean[k] += (light[4 * i + k] * solidAngle) / (4 * Math.PI);
    const luminance = 0.2126 * r + 0.7152 * g + 0.0722 * b;
    weights[i] = luminance * solidAngle;
    sum += weights[i];
    light[4 * i + 3] = luminance;
  }
  if (sum <= 0) return { width, height, light, aliases: unaliased(count), mean };
  for (let i = 0; i < count; i++) light[4 * i + 3] /= sum;
  return { width, height, light, aliases: aliasesOf(weights, sum), mean };
}

/** Returns the same light, scaled to the mean luminance `luminance`; a dark environment stays dark. */
export function asBrightAs(tables: EnvironmentTables, luminance: number): EnvironmentTables {
  const [r, g, b] = tables.mean;
  const found = 0.2126 * r + 0.7152 * g + 0.0722 * b;
  if (found <= 0) return tables;
  const factor = luminance / found;
  const light = tables.light.map((v, i) => (i % 4 === 3 ? v : factor * v)); // the probability densities do not change
  return { ...tables, light, mean: [factor * r, factor * g, factor * b] };
}

function unaliased(count: number): Float32Array<ArrayBuffer> {
  return Float32Array.from({ length: 2 * count }, (_, i) => (i % 2 === 0 ? 1 : (i - 1) / 2));
}

function aliasesOf(weights: Float64Array, sum: number): Float32Array<ArrayBuffer> {
  const count = weights.length;
  const aliases = unaliased(count);
  const shares = weights.map((w) => (w * count) / sum);
  const small: number[] = [];
  const large: number[] = [];
  shares.forEach((share, i) => {
    (share < 1 ? small : large).push(i);
  });
  while (small.length > 0 && large.length > 0) {
    const less = small.pop() as number;
    const more = large[large.length - 1];
    aliases[2 * less] = shares[less];
    aliases[2 * less + 1] = more;
    shares[more] -= 1 - shares[less];
    if (shares[more] < 1) small.push(large.pop() as number);
  }
  return aliases;
}
