/**
 * The scale bar of a flat screen, in the lower left corner of the frame. In perspective, near things look larger
 * than far ones. The bar is therefore exact only at the depth of the point that the camera orbits.
 */
import { element } from "../dom/element";
import { chooseScaleBar, type ScaleBar } from "../math/round_length";

export class ScaleBarMark {
  private readonly bar = element("div", { className: "bar" });
  private readonly label = element("span");
  readonly root = element("div", { className: "scale-bar" }, { scale: "" }, this.bar, this.label);
  private before: ScaleBar | null = null;

  /** @param um_per_px size of a pixel at the depth of the focus, um; null hides the bar */
  update(um_per_px: number | null): void {
    const bar = um_per_px === null ? null : chooseScaleBar(um_per_px);
    this.root.hidden = bar === null;
    if (bar === null || bar.length_px === this.before?.length_px) return;
    this.before = bar;
    this.bar.style.width = `${bar.length_px}px`;
    this.label.textContent = bar.label;
  }

  dispose(): void {
    this.root.remove();
  }
}
