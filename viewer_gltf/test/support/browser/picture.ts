/** Pixels of a screenshot of the page. */
import type { Page } from "playwright-core";
import { decodePng } from "./png";

export type Pixel = readonly [number, number, number];
export type Area = Readonly<{ x: number; y: number; width: number; height: number }>;

export class Picture {
  constructor(
    readonly width: number,
    readonly height: number,
    private readonly rgba: Uint8Array,
  ) {}

  at(x: number, y: number): Pixel {
    const i = 4 * (Math.round(y) * this.width + Math.round(x));
    return [this.rgba[i], this.rgba[i + 1], this.rgba[i + 2]];
  }

  count(matches: (pixel: Pixel) => boolean): number {
    return this.where(matches).length;
  }

  /** Returns the positions of the matching pixels. */
  where(matches: (pixel: Pixel) => boolean): [number, number][] {
    const found: [number, number][] = [];
    for (let y = 0; y < this.height; y++) {
      for (let x = 0; x < this.width; x++) {
        if (matches(this.at(x, y))) found.push([x, y]);
      }
    }
    return found;
  }
}

/** Returns the share of pixels that clearly differ. */
export function difference(a: Picture, b: Picture): number {
  let differing = 0;
  for (let y = 0; y < a.height; y++) {
    for (let x = 0; x < a.width; x++) {
      const other = b.at(x, y);
      if (a.at(x, y).some((v, i) => Math.abs(v - other[i]) > 8)) differing++;
    }
  }
  return differing / (a.width * a.height);
}

/** Runs a job while marks, announcements and buttons over the view are hidden. */
export async function withoutMarks<T>(page: Page, job: () => Promise<T>): Promise<T> {
  const show = (visibility: string) =>
    page.evaluate((value) => {
      const marks =
        ".scale-bar, .orientation-mark, .name-mark, .announcement, .first-hint, .tap-area, .view-message, .ways-in";
      for (const mark of document.querySelectorAll<HTMLElement | SVGElement>(marks)) {
        mark.style.visibility = value;
      }
    }, visibility);
  await show("hidden");
  try {
    return await job();
  } finally {
    await show("");
  }
}

/** Takes a screenshot of the stage (or of `area`), without the elements over it. */
export async function takePicture(page: Page, area?: Area): Promise<Picture> {
  const clip = area ?? (await page.locator(".stage").boundingBox()) ?? undefined;
  const png = await withoutMarks(page, () => page.screenshot({ clip }));
  const { width, height, rgba } = decodePng(png);
  return new Picture(width, height, rgba);
}

/** Returns whether a pixel has the colour of the background. */
export function isBackground([r, g, b]: Pixel): boolean {
  return Math.abs(r - 11) + Math.abs(g - 13) + Math.abs(b - 18) < 8;
}

/**
 * Returns whether a pixel has a colour (linear) in any light: its hue is similar, and it is not
 * grey. Hue and saturation are compared in sRGB, which white light hardly changes.
 */
export function hasColor(linear: Pixel, tolerance_deg = 22): (pixel: Pixel) => boolean {
  const wanted = hue(linear.map((v) => 255 * v ** (1 / 2.2)) as unknown as Pixel);
  return (pixel) => {
    const found = hue(pixel);
    if (wanted === null || found === null) return false;
    const apart = Math.abs(found - wanted) % 360;
    return Math.min(apart, 360 - apart) < tolerance_deg;
  };
}

/** Returns the hue in degrees; null if a pixel is too grey or too dark. */
function hue([r, g, b]: Pixel): number | null {
  const high = Math.max(r, g, b);
  const spread = high - Math.min(r, g, b);
  if (high < 40 || spread < 0.25 * high) return null;
  if (high === r) return (60 * (g - b)) / spread;
  if (high === g) return 120 + (60 * (b - r)) / spread;
  return 240 + (60 * (r - g)) / spread;
}
