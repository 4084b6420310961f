/**
 * The optics of Cardboard lenses: which point of the screen an eye sees in which direction, and how
 * much each eye can see.
 *
 * The model is that of Google's Cardboard SDK. A point of the screen lies at r, the tangent of its
 * angle from the lens's axis, measured at the lens. The eye sees it at r (1 + k1 r^2 + k2 r^4 +
 * ...). Each eye's image is rendered undistorted within these tangents, and drawn through the
 * inverse, so that the lens makes it straight again.
 */
import { distort, type LensModel } from "./lens_model";

export type Side = "left" | "right";

/** Size of the canvas on the phone, which is held in landscape. */
export type Screen = Readonly<{
  width_m: number;
  height_m: number;
  /** From the phone's edge, which rests on the tray, to the first row of pixels, metres. */
  border_m: number;
}>;

/**
 * Tangents of the angles that an eye's image covers from the lens's axis to each side; all
 * positive.
 */
export type Tangents = Readonly<{ left: number; right: number; bottom: number; top: number }>;

const BORDER_m = 0.003;
const INCH_m = 0.0254;
/** CSS pixels per inch by Android's definition. Real phones differ by up to 10 %. */
export const CSS_PIXELS_PER_INCH = 160;

/**
 * Estimates the CSS pixels per inch, since a browser does not report the size of the screen.
 * On an iPhone the pixel ratio gives it (458 to 476 dots per inch at ratio 3, 326 at 2). On other
 * phones it is taken as 160. The user can set a better value: the phone's dots per inch divided by
 * its devicePixelRatio.
 */
export function cssPixelsPerInch(userAgent: string, devicePixelRatio: number): number {
  if (!/iPhone|iPod/.test(userAgent)) return CSS_PIXELS_PER_INCH;
  return devicePixelRatio >= 2.5 ? 153.3 : 163;
}

/**
 * Returns the size of a canvas of `width` x `height` CSS pixels. The canvas is taken to reach the
 * lower edge of the screen, since browser bars that cannot be hidden lie at the top.
 */
export function screenOf(width: number, height: number, perInch: number): Screen {
  const pixel_m = INCH_m / perInch;
  return { width_m: width * pixel_m, height_m: height * pixel_m, border_m: BORDER_m };
}

/**
 * Tangent on the screen at which the eye sees tangent `r`: the inverse of `distort`, by bisection.
 */
export function undistort(k: readonly number[], r: number): number {
  let low = 0;
  let high = r;
  // needed for lenses that make the image smaller, where the result exceeds r
  while (distort(k, high) < r && high < 100) high *= 1.5;
  for (let i = 0; i < 54; i++) {
    const middle = (low + high) / 2;
    if (distort(k, middle) < r) low = middle;
    else high = middle;
  }
  return (low + high) / 2;
}

/**
 * The point where the axis of an eye's lens meets the screen, in metres from its lower left corner.
 */
export function lensCentre(
  model: LensModel,
  screen: Screen,
  side: Side,
): readonly [number, number] {
  const { width_m, height_m, border_m } = screen;
  const shift_m = ((side === "left" ? -1 : 1) * model.interLens_m) / 2;
  const fromTray_m = model.trayToLens_m - border_m;
  const y_m = { bottom: fromTray_m, center: height_m / 2, top: height_m - fromTray_m };
  // If a window is too small for the lenses, as on a desktop, each eye gets the middle of its half.
  const isWide = width_m > 1.2 * model.interLens_m;
  const isHigh = Math.abs(y_m[model.alignment] / height_m - 0.5) < 0.35;
  return [
    width_m / 2 + (isWide ? shift_m : (Math.sign(shift_m) * width_m) / 4),
    isHigh ? y_m[model.alignment] : height_m / 2,
  ];
}

/**
 * How far an eye can see to each side: the lesser of the lens's field of view and the edge of its
 * half of the screen.
 */
export function eyeTangents(model: LensModel, screen: Screen, side: Side): Tangents {
  const { fov_deg, distortion, screenToLens_m } = model;
  const [x_m, y_m] = lensCentre(model, screen, side);
  const middle_m = screen.width_m / 2; // an eye's half of the screen ends here
  const [left_m, right_m] =
    side === "left" ? [x_m, middle_m - x_m] : [x_m - middle_m, screen.width_m - x_m];
  const [left_deg, right_deg] =
    side === "left" ? [fov_deg.outer, fov_deg.inner] : [fov_deg.inner, fov_deg.outer];
  const reach = (edge_m: number, lens_deg: number) =>
    Math.min(distort(distortion, edge_m / screenToLens_m), Math.tan((lens_deg * Math.PI) / 180));
  return {
    left: reach(left_m, left_deg),
    right: reach(right_m, right_deg),
    bottom: reach(y_m, fov_deg.bottom),
    top: reach(screen.height_m - y_m, fov_deg.top),
  };
}

/**
 * Returns the point of the screen at which an eye sees the direction (x, y, -1) of its own space.
 * The point is given in shares of the screen's width and height from its lower left corner.
 */
export function toScreen(
  model: LensModel,
  screen: Screen,
  side: Side,
  x: number,
  y: number,
): readonly [number, number] {
  const [x_m, y_m] = lensCentre(model, screen, side);
  const r = Math.hypot(x, y);
  const scale_m = model.screenToLens_m * (r === 0 ? 1 : undistort(model.distortion, r) / r);
  return [(x_m + x * scale_m) / screen.width_m, (y_m + y * scale_m) / screen.height_m];
}
