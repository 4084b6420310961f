/** Chooses the resolution of the path-traced frame, which is low while the view moves. */
import type { Eyes } from "../gpu/eyes";

/** Largest number of pixels of a frame. More would need more memory than a phone's browser grants. */
const MAX_PIXELS = 2_000_000;
/** Largest number of pixels while the view moves; the denoiser hides the low resolution. */
const MAX_MOVING_PIXELS = 160_000;

export class PictureScale {
  /** Whether the frame has the low resolution of a moving view. */
  isSmall = false;
  private moving = 1;
  private atRest = 1;

  /** Stores the resolution that the time for a frame allows, relative to the frame buffer, 0..1. */
  allow(resolution: number, isMoving: boolean, isOther: boolean): void {
    if (isOther) this.moving = resolution;
    if (!isMoving) this.atRest = resolution;
  }

  /** Returns the resolution relative to the frame buffer, of a low-resolution frame or of a full one. */
  choose({ width_px, height_px }: Eyes, isSmall: boolean): number {
    this.isSmall = isSmall;
    const most = isSmall ? MAX_MOVING_PIXELS : MAX_PIXELS;
    const fits = Math.sqrt(most / (width_px * height_px));
    return Math.min(isSmall ? this.moving : this.atRest, fits);
  }
}
