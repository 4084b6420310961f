import { describe, expect, it } from "vitest";
import { GAP_PX, type Point, placeBeside, type Size } from "./place_beside";

const CARD: Size = { width: 248, height: 200 };
/** Areas of the view beside or above the panel, for common sizes of windows. */
const AREAS: readonly Size[] = [
  { width: 390, height: 464 }, // 390 x 844
  { width: 580, height: 390 }, // 844 x 390
  { width: 636, height: 600 }, // 900 x 600
  { width: 1656, height: 1080 }, // 1920 x 1080
];

/** Distance from a point to a card; 0 inside. */
function distance({ x, y }: Point, at: Point, { width, height }: Size): number {
  const off = (v: number, low: number, size: number) => Math.max(low - v, 0, v - low - size);
  return Math.hypot(off(x, at.x, width), off(y, at.y, height));
}

describe("a card beside a place", () => {
  it.each(AREAS)("stays in $width x $height and does not cover the place, at any place", (area) => {
    for (let x = 0; x <= area.width; x += 10) {
      for (let y = 0; y <= area.height; y += 10) {
        const at = placeBeside({ x, y }, CARD, area);
        expect(at.x).toBeGreaterThanOrEqual(0);
        expect(at.y).toBeGreaterThanOrEqual(0);
        expect(at.x + CARD.width).toBeLessThanOrEqual(area.width);
        expect(at.y + CARD.height).toBeLessThanOrEqual(area.height);
        expect(distance({ x, y }, at, CARD), `${x}, ${y}`).toBeGreaterThanOrEqual(GAP_PX);
      }
    }
  });

  it("goes to the far corner of an area without space on any side", () => {
    expect(placeBeside({ x: 100, y: 90 }, CARD, { width: 300, height: 240 })).toEqual({
      x: 300 - 8 - CARD.width,
      y: 240 - 8 - CARD.height,
    });
  });
});
