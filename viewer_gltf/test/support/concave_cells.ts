/** Two cells that touch at a concave corner: squares of 3 um, each with a notch that the next one fills. */
type Vec2 = readonly [number, number];

export const WIDTH_UM = 3;
const OUTLINE: readonly Vec2[] = [
  [0, 0],
  [3, 0],
  [3, 2],
  [2, 2],
  [2, 3],
  [0, 3],
];
export const CELLS = [0, 2].map((by) => OUTLINE.map(([x, y]): Vec2 => [x + by, y + by]));
/** Minima x, y, z, then maxima. The cells stand on z = 0 and are as high as they are wide. */
export const BOXES = Float32Array.from([0, 2].flatMap((v) => [v, v, 0, v + 3, v + 3, WIDTH_UM]));
/** Points on the interface between both cells. */
export const WALL: readonly Vec2[] = [
  [2, 2.1],
  [2, 2.5],
  [2, 2.9],
  [2, 2],
  [2.5, 2],
  [2.9, 2],
];

/** Returns points along an outline, including its corners. */
export function along(outline: readonly Vec2[]): Vec2[] {
  return outline.flatMap(([x, y], i) => {
    const [nextX, nextY] = outline[(i + 1) % outline.length];
    return [0, 0.25, 0.5, 0.75].map((t): Vec2 => [x + t * (nextX - x), y + t * (nextY - y)]);
  });
}

/** Counts the edges that a line to the right crosses. */
export function isWithin(outline: readonly Vec2[], [x, y]: Vec2): boolean {
  const crossed = outline.filter(([x0, y0], i) => {
    const [x1, y1] = outline[(i + 1) % outline.length];
    return y0 > y !== y1 > y && x < x0 + ((y - y0) / (y1 - y0)) * (x1 - x0);
  });
  return crossed.length % 2 === 1;
}
