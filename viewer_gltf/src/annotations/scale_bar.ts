/**
 * The scale bar of a flat screen, over the picture's lower left corner. It is true in the plane
 * through the point that is looked at: nearer things are larger, as a picture in perspective has it.
 */
import { element } from "../dom/element";
import { chooseScaleBar, type ScaleBar } from "../math/round_length";

export class ScaleBarMark {
  private readonly bar = element("div", { className: "bar" });
  private readonly label = element("span");
  readonly root = element("div", { className: "scale-bar" }, { scale: "" }, this.bar, this.label);
  private before: ScaleBar | null = null;

  /** null: there is none. */
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
