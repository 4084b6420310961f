/** Colours are linear RGB everywhere except in the panel's inputs, which use sRGB hex. */
export type Rgb = readonly [number, number, number];

function encode(linear: number): number {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * linear ** (1 / 2.4) - 0.055;
}

function decode(srgb: number): number {
  return srgb <= 0.04045 ? srgb / 12.92 : ((srgb + 0.055) / 1.055) ** 2.4;
}

/**
 * Converts a linear colour to `#rrggbb`, sRGB (IEC 61966-2-1); parts outside 0 to 1 are clipped.
 */
export function toHex(color: Rgb): string {
  const byte = (v: number) =>
    Math.round(255 * encode(Math.min(1, Math.max(0, v))))
      .toString(16)
      .padStart(2, "0");
  return `#${color.map(byte).join("")}`;
}

/** Converts `#rrggbb` to a linear colour. Throws RangeError for other text. */
export function fromHex(hex: string): Rgb {
  if (!/^#[0-9a-f]{6}$/i.test(hex)) throw new RangeError(`colour is ${hex}, expected #rrggbb`);
  const part = (i: number) => decode(Number.parseInt(hex.slice(i, i + 2), 16) / 255);
  return [part(1), part(3), part(5)];
}

/**
 * The colour in which to draw a surface. A glb may have an artist's colour for its own tile. It
 * stays until the user chooses a colour for the channel.
 */
export function surfaceColor(glb: Rgb, original: Rgb, chosen: Rgb): Rgb {
  return chosen.every((v, i) => v === original[i]) ? glb : chosen;
}

/**
 * Lightness and two axes of hue, after Ottosson, "A perceptual color space for image processing",
 * 2020.
 */
export function toOklab([r, g, b]: Rgb): Rgb {
  const [l, m, s] = [
    0.4122214708 * r + 0.5363325363 * g + 0.0514459929 * b,
    0.2119034982 * r + 0.6806995451 * g + 0.1073969566 * b,
    0.0883024619 * r + 0.2817188376 * g + 0.6299787005 * b,
  ].map(Math.cbrt);
  return [
    0.2104542553 * l + 0.793617785 * m - 0.0040720468 * s,
    1.9779984951 * l - 2.428592205 * m + 0.4505937099 * s,
    0.0259040371 * l + 0.7827717662 * m - 0.808675766 * s,
  ];
}
