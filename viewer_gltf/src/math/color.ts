/** Colours are linear RGB everywhere but in the panel's inputs, which speak sRGB hex. */
export type Rgb = readonly [number, number, number];

function encode(linear: number): number {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * linear ** (1 / 2.4) - 0.055;
}

function decode(srgb: number): number {
  return srgb <= 0.04045 ? srgb / 12.92 : ((srgb + 0.055) / 1.055) ** 2.4;
}

/** `#rrggbb`, sRGB (IEC 61966-2-1), of a linear colour; parts outside 0..1 are clipped. */
export function toHex(color: Rgb): string {
  const byte = (v: number) =>
    Math.round(255 * encode(Math.min(1, Math.max(0, v))))
      .toString(16)
      .padStart(2, "0");
  return `#${color.map(byte).join("")}`;
}

/** The linear colour of `#rrggbb`. Throws RangeError on anything else. */
export function fromHex(hex: string): Rgb {
  if (!/^#[0-9a-f]{6}$/i.test(hex)) throw new RangeError(`expected #rrggbb, found ${hex}`);
  const part = (i: number) => decode(Number.parseInt(hex.slice(i, i + 2), 16) / 255);
  return [part(1), part(3), part(5)];
}

/**
 * The colour to draw a surface in. A glb may carry an artist's colour for its own tile: it stays
 * until the user chooses a colour for the channel.
 */
export function surfaceColor(glb: Rgb, original: Rgb, chosen: Rgb): Rgb {
  return chosen.every((v, i) => v === original[i]) ? glb : chosen;
}
