/** The lens profile's optics, and the distortion of the lenses; see lens.ts. */

/** The edge of the phone from which the lenses' height is measured. */
export type Alignment = "bottom" | "center" | "top";

/** The two lenses and their place in front of the screen. */
export type LensModel = Readonly<{
  screenToLens_m: number;
  interLens_m: number;
  /** Field of view of the left lens to each side, degrees; the right lens mirrors it. */
  fov_deg: Readonly<{ outer: number; inner: number; bottom: number; top: number }>;
  alignment: Alignment;
  /** From the edge on which the phone rests to the lenses' centres, metres. */
  trayToLens_m: number;
  /** k1, k2, ... of r (1 + k1 r^2 + k2 r^4 + ...), where r is the tangent of the angle. */
  distortion: readonly number[];
}>;

/** Returns the tangent at which the eye sees tangent `r` of the screen. */
export function distort(k: readonly number[], r: number): number {
  const r2 = r * r;
  return r * (1 + k.reduceRight((sum, each) => r2 * (each + sum), 0));
}

/**
 * Whether the distortion increases all the way to the seen tangent `most`, so that it has an
 * inverse.
 */
export function isIncreasing(k: readonly number[], most: number): boolean {
  const STEP = 0.01;
  let seen = 0;
  for (let r = STEP; seen < most; r += STEP) {
    const next = distort(k, r);
    if (!(next > seen)) return false; // also false for NaN
    seen = next;
  }
  return true;
}
