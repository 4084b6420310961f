/** The colours beside a channel's swatch: they open under a gaze that rests on it. */

/** Time, s, after which colours lie beside a swatch that is looked at. */
const FAN_S = 0.4;

export class SwatchFan {
  /** The target that is pointed at, and for how long. */
  private lit: string | null = null;
  private lit_s = 0;

  /** The target that is pointed at now; null: none is. */
  point(id: string | null): void {
    if (id !== this.lit) this.lit_s = 0;
    this.lit = id;
  }

  /**
   * Return the group whose colours are open after so much time. They lie over the channel's name until the gaze
   * has left the row for as long as it took to open them: a head that trembles is still there.
   *
   * @param fanned the group whose colours are open; null: none are
   */
  advance(dt_s: number, fanned: string | null): string | null {
    this.lit_s += dt_s;
    if (this.lit_s < FAN_S) return fanned;
    const swatch = this.lit?.endsWith("/open") ? this.lit.slice(0, -"/open".length) : null;
    const isInRow = fanned !== null && this.lit?.startsWith(`${fanned}/`) === true;
    return swatch ?? (isInRow ? fanned : null);
  }
}
