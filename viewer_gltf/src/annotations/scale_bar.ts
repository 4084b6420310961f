/**
 * The scale bar of a flat screen, over the picture's lower left corner. It is true in the plane
 * through the point that is looked at: nearer things are larger, as a picture in perspective has it.
 */
import type { PerspectiveCamera, Vector3 } from "three";
import { element } from "../dom/element";
import { chooseScaleBar, type ScaleBar, umPerPixel } from "../math/round_length";

/**
 * Um to a CSS pixel at the depth of a point of the room.
 *
 * @param height_px of the picture
 */
export function umPerPixelAt(
  focus: Vector3,
  camera: PerspectiveCamera,
  height_px: number,
  m_per_um: number,
): number {
  const depth_m = -focus.clone().applyMatrix4(camera.matrixWorldInverse).z;
  const fov_rad = 2 * Math.atan(1 / camera.projectionMatrix.elements[5]);
  return umPerPixel(depth_m, fov_rad, height_px, m_per_um);
}

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
