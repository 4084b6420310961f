/** How large the path-traced picture is, to the frame buffer's pixels: small while the view moves. */
import type { Eyes } from "../gpu/eyes";

/** Most pixels of a picture: more take more memory than a phone's browser gives. */
const MAX_PIXELS = 2_000_000;
/** Most pixels while the picture moves: the denoiser fills in the rest. */
const MAX_MOVING_PIXELS = 160_000;

export class PictureScale {
  /** Whether the picture is the small one of a moving view. */
  isSmall = false;
  private moving = 1;
  private atRest = 1;

  /** Take over the share of the pixels that the frame's budget allows, 0..1. */
  allow(resolution: number, isMoving: boolean, isOther: boolean): void {
    if (isOther) this.moving = resolution;
    if (!isMoving) this.atRest = resolution;
  }

  /** Choose the scale of a picture that is small, or not. */
  choose({ width_px, height_px }: Eyes, isSmall: boolean): number {
    this.isSmall = isSmall;
    const most = isSmall ? MAX_MOVING_PIXELS : MAX_PIXELS;
    const fits = Math.sqrt(most / (width_px * height_px));
    return Math.min(isSmall ? this.moving : this.atRest, fits);
  }
}
