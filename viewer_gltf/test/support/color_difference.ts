/**
 * Visible difference of two colours: CIEDE2000 (Sharma, Wu & Dalal, Color Research & Application
 * 30, 2005).
 */
import type { Pixel } from "./browser/picture";

export type Lab = readonly [number, number, number];

const WHITE = [0.95047, 1, 1.08883]; // D65
const XYZ = [
  [0.4124564, 0.3575761, 0.1804375],
  [0.2126729, 0.7151522, 0.072175],
  [0.0193339, 0.119192, 0.9503041],
];

/** Returns CIE L*a*b* of a pixel, sRGB 0..255. */
export function toLab(pixel: Pixel): Lab {
  const linear = pixel.map((v) => {
    const s = v / 255;
    return s <= 0.04045 ? s / 12.92 : ((s + 0.055) / 1.055) ** 2.4;
  });
  const [x, y, z] = XYZ.map((row, i) => {
    const t = row.reduce((sum, k, j) => sum + k * linear[j], 0) / WHITE[i];
    return t > (6 / 29) ** 3 ? Math.cbrt(t) : t / (3 * (6 / 29) ** 2) + 4 / 29;
  });
  return [116 * y - 16, 500 * (x - y), 200 * (y - z)];
}

const rad = (deg: number) => (deg * Math.PI) / 180;
const cos = (deg: number) => Math.cos(rad(deg));
/** Weight of a chroma: small for greys, near 1 for strong colours. */
const strong = (chroma: number) => Math.sqrt(chroma ** 7 / (chroma ** 7 + 25 ** 7));
const hueOf = (a: number, b: number) => ((((Math.atan2(b, a) * 180) / Math.PI) % 360) + 360) % 360;

/** Returns the difference; 1 is just visible, side by side. */
export function colorDifference([L1, a1, b1]: Lab, [L2, a2, b2]: Lab): number {
  const stretch = 1 + 0.5 * (1 - strong((Math.hypot(a1, b1) + Math.hypot(a2, b2)) / 2));
  const [C1, C2] = [Math.hypot(stretch * a1, b1), Math.hypot(stretch * a2, b2)];
  const [h1, h2] = [hueOf(stretch * a1, b1), hueOf(stretch * a2, b2)];
  const isGrey = C1 * C2 === 0;
  const isAcross = Math.abs(h2 - h1) > 180; // the shorter way leads through 0 degrees
  const turn = h2 - h1 - (isAcross ? 360 * Math.sign(h2 - h1) : 0);
  const dH = isGrey ? 0 : 2 * Math.sqrt(C1 * C2) * Math.sin(rad(turn / 2));
  const sum = h1 + h2;
  const h = isGrey ? sum : (isAcross ? sum + (sum < 360 ? 360 : -360) : sum) / 2;
  const C = (C1 + C2) / 2;
  const away = ((L1 + L2) / 2 - 50) ** 2;
  const T =
    1 - 0.17 * cos(h - 30) + 0.24 * cos(2 * h) + 0.32 * cos(3 * h + 6) - 0.2 * cos(4 * h - 63);
  const l = (L2 - L1) / (1 + (0.015 * away) / Math.sqrt(20 + away));
  const c = (C2 - C1) / (1 + 0.045 * C);
  const hue = dH / (1 + 0.015 * C * T);
  const blue = -Math.sin(rad(60 * Math.exp(-(((h - 275) / 25) ** 2)))) * 2 * strong(C);
  return Math.sqrt(l * l + c * c + hue * hue + blue * c * hue);
}
