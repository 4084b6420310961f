/** The lenses of a Cardboard viewer, and their distortion; see lens.ts. Pure. */

/** Where the phone rests. */
export type Alignment = "bottom" | "center" | "top";

/** The two lenses and how they lie before the screen. */
export type LensModel = Readonly<{
  screenToLens_m: number;
  interLens_m: number;
  /** How far the left lens lets the eye see to each side; the right one mirrors it. */
  fov_deg: Readonly<{ outer: number; inner: number; bottom: number; top: number }>;
  alignment: Alignment;
  /** From where the phone rests to the lenses' centres. */
  trayToLens_m: number;
  /** k1, k2, ... of r (1 + k1 r^2 + k2 r^4 + ...), r in tangents of the angle. */
  distortion: readonly number[];
}>;

/** Tangent at which the eye sees what is at tangent `r` of the screen. */
export function distort(k: readonly number[], r: number): number {
  const r2 = r * r;
  return r * (1 + k.reduceRight((sum, each) => r2 * (each + sum), 0));
}

/** Whether every tangent up to `most` is seen at one place of the screen only. */
export function isIncreasing(k: readonly number[], most: number): boolean {
  const STEP = 0.01;
  let seen = 0;
  for (let r = STEP; seen < most; r += STEP) {
    const next = distort(k, r);
    if (!(next > seen)) return false; // not a number neither
    seen = next;
  }
  return true;
}
