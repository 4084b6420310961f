/** Finds the pixels of an object, and the overlap of two such sets. Pure. */
import type { Picture } from "./browser/picture";

/** Whether each pixel shows the object, row by row. */
export type Silhouette = readonly boolean[];

/** Largest component of the background colour, 0..255. */
const BACKGROUND = 18;
/** Smallest brightness, 0..255, of pixels that are not background. */
const LIT = 48;
/** Radius of the neighbourhood in which the brightest pixel is found, pixels. */
const AROUND = 3;

function toLight(value: number): number {
  const s = value / 255;
  return s <= 0.04045 ? s / 12.92 : ((s + 0.055) / 1.055) ** 2.4;
}

/**
 * Returns the pixels of which the object covers at least half, by half the light of the brightest
 * pixel nearby. The shading of the object, which darkens its limb, therefore does not move the
 * edges.
 */
export function silhouetteOf(picture: Picture): Silhouette {
  const { width, height } = picture;
  const light = Array.from({ length: width * height }, (_, i) =>
    Math.max(...picture.at(i % width, Math.floor(i / width))),
  );
  const most = largestAround(largestAround(light, width, 1), width, width);
  const dark = toLight(BACKGROUND);
  return light.map((v, i) => most[i] > LIT && toLight(v) - dark >= (toLight(most[i]) - dark) / 2);
}

/**
 * Returns the largest value among each value and its neighbours along a row (stride 1) or a column
 * (stride of a row).
 */
function largestAround(values: readonly number[], width: number, stride: number): number[] {
  return values.map((_, i) => {
    let most = 0;
    for (let k = -AROUND; k <= AROUND; k++) {
      const x = (i % width) + (stride === 1 ? k : 0);
      if (x >= 0 && x < width) most = Math.max(most, values[i + k * stride] ?? 0);
    }
    return most;
  });
}

/** Returns intersection over union. */
export function overlap(a: Silhouette, b: Silhouette): number {
  const both = a.filter((inside, i) => inside && b[i]).length;
  const either = a.filter((inside, i) => inside || b[i]).length;
  return both / either;
}
