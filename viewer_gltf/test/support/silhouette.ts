/** Where a picture shows an object, and how much two such places have in common. Pure. */
import type { Picture } from "./browser/picture";

/** Row by row, whether a pixel shows the object. */
export type Silhouette = readonly boolean[];

/** The largest part of the colour of the scene's background, of 255. */
const BACKGROUND = 18;
/** Least brightness, of 255, of anything that is no background. */
const LIT = 48;
/** Pixels around one in which the brightest is looked for. */
const AROUND = 3;

function toLight(value: number): number {
  const s = value / 255;
  return s <= 0.04045 ? s / 12.92 : ((s + 0.055) / 1.055) ** 2.4;
}

/**
 * Pixels of which the object covers at least half: half of the light of the brightest pixel nearby.
 * The object's own shading, which darkens its limb, thus moves no edge.
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
 * The largest of each value and its neighbours along a row (stride 1) or a column (stride of a row).
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

/** Intersection over union. */
export function overlap(a: Silhouette, b: Silhouette): number {
  const both = a.filter((inside, i) => inside && b[i]).length;
  const either = a.filter((inside, i) => inside || b[i]).length;
  return both / either;
}
