/**
 * What a Cardboard's lenses do, in pure numbers: where on the screen the eye sees which direction,
 * and how much of the world each eye can see. The model is that of Google's Cardboard SDK: a point
 * of the screen at r (tangent of its angle from the lens's axis, the eye at the lens) is seen at
 * r (1 + k1 r^2 + k2 r^4 + ...). Each eye's picture is drawn undistorted, by these tangents, and
 * put on the screen through the inverse, so that the lens makes it straight again.
 */
import { distort, type LensModel } from "./lens_model";

export type Side = "left" | "right";

/** Of the canvas as it lies on the phone, held across. */
export type Screen = Readonly<{
  width_m: number;
  height_m: number;
  /** From the phone's edge, which rests on the tray, to the first row of pixels. */
  border_m: number;
}>;

/** How far an eye's picture reaches from the lens's axis to each side, all positive. */
export type Tangents = Readonly<{ left: number; right: number; bottom: number; top: number }>;

const BORDER_m = 0.003;
const INCH_m = 0.0254;
/** CSS pixels per inch by Android's own definition; phones round it by up to a tenth. */
export const CSS_PIXELS_PER_INCH = 160;

/**
 * A browser doesn't report a screen's size. On an iPhone the pixel ratio gives it (458 to 476
 * dots per inch at 3, 326 at 2); elsewhere a CSS pixel is taken to be 1/160 inch. The user can set
 * a better value: a phone's true figure is its dots per inch over its devicePixelRatio.
 */
export function cssPixelsPerInch(userAgent: string, devicePixelRatio: number): number {
  if (!/iPhone|iPod/.test(userAgent)) return CSS_PIXELS_PER_INCH;
  return devicePixelRatio >= 2.5 ? 153.3 : 163;
}

/**
 * The screen of a canvas of `width` x `height` CSS pixels. Its lower edge is taken to be that of
 * the screen: bars of a browser that can't be hidden lie on top.
 */
export function screenOf(width: number, height: number, perInch: number): Screen {
  const pixel_m = INCH_m / perInch;
  return { width_m: width * pixel_m, height_m: height * pixel_m, border_m: BORDER_m };
}

/** Where on the screen the eye sees tangent `r`: the inverse, by halving an interval around it. */
export function undistort(k: readonly number[], r: number): number {
  let low = 0;
  let high = r;
  while (distort(k, high) < r && high < 100) high *= 1.5; // lenses that shrink
  for (let i = 0; i < 54; i++) {
    const middle = (low + high) / 2;
    if (distort(k, middle) < r) low = middle;
    else high = middle;
  }
  return (low + high) / 2;
}

/** Where the axis of an eye's lens meets the screen, in metres from its lower left corner. */
export function lensCentre(
  model: LensModel,
  screen: Screen,
  side: Side,
): readonly [number, number] {
  const { width_m, height_m, border_m } = screen;
  const shift_m = ((side === "left" ? -1 : 1) * model.interLens_m) / 2;
  const fromTray_m = model.trayToLens_m - border_m;
  const y_m = { bottom: fromTray_m, center: height_m / 2, top: height_m - fromTray_m };
  // A window that is too small for the viewer, as on a desktop, still shows both eyes in full.
  const isWide = width_m > 1.2 * model.interLens_m;
  const isHigh = Math.abs(y_m[model.alignment] / height_m - 0.5) < 0.35;
  return [
    width_m / 2 + (isWide ? shift_m : (Math.sign(shift_m) * width_m) / 4),
    isHigh ? y_m[model.alignment] : height_m / 2,
  ];
}

/** What an eye can see: less of what its lens lets through and what the screen shows there. */
export function eyeTangents(model: LensModel, screen: Screen, side: Side): Tangents {
  const { fov_deg, distortion, screenToLens_m } = model;
  const [x_m, y_m] = lensCentre(model, screen, side);
  const middle_m = screen.width_m / 2; // an eye's half of the screen ends there
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
 * Where the screen has to show the direction (x, y, -1) of an eye's space, so that it is seen
 * there: shares of the screen's width and height from its lower left corner.
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
