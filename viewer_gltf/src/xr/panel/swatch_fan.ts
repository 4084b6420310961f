/** The colours beside a channel's swatch, which open under a resting gaze. */

/** Seconds that a swatch must be looked at until its colours open. */
const FAN_S = 0.4;

export class SwatchFan {
  /** The target that is pointed at, and for how long, s. */
  private lit: string | null = null;
  private lit_s = 0;

  /** Sets the target that is pointed at now; null if there is none. */
  point(id: string | null): void {
    if (id !== this.lit) this.lit_s = 0;
    this.lit = id;
  }

  /**
   * Returns the group whose colours are open after `dt_s` more seconds. The colours cover the
   * channel's name until the gaze has left the row for as long as it took to open them. So a
   * trembling head does not close them.
   *
   * @param fanned the group whose colours are open, or null
   */
  advance(dt_s: number, fanned: string | null): string | null {
    this.lit_s += dt_s;
    if (this.lit_s < FAN_S) return fanned;
    const swatch = this.lit?.endsWith("/open") ? this.lit.slice(0, -"/open".length) : null;
    const isInRow = fanned !== null && this.lit?.startsWith(`${fanned}/`) === true;
    return swatch ?? (isInRow ? fanned : null);
  }
}
