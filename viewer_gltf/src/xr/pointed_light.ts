/**
 * Marks of the targets that are pointed at: the hands' rays, the dwell ring, and the light on a
 * control.
 */
import { type Matrix4, Vector3 } from "three";
import { Ring } from "../interaction/dwell_ring";
import { type Pointer, pointOn } from "../interaction/ray_pointer";
import type { Controllers } from "./controllers";
import type { Grips } from "./grips";
import type { HeadsetPanel } from "./panel/panel";

export type PointedLightOptions = Readonly<{
  pointer: Pointer;
  controllers: Controllers;
  grips: Grips;
  panel: HeadsetPanel;
}>;

export class PointedLight {
  readonly ring = new Ring();
  private shown = "";

  constructor(private readonly options: PointedLightOptions) {}

  /** Updates the marks for this frame. Returns whether the image differs from the last one. */
  draw(head: Matrix4): boolean {
    const { pointer, controllers, grips, panel } = this.options;
    grips.tracked.forEach((hand, i) => {
      controllers.draw(hand, pointer.hands[i]?.distance_m ?? null);
    });
    const { leading, progress } = pointer;
    panel.light(leading?.key ?? null);
    const eye = new Vector3().setFromMatrixPosition(head);
    if (leading === null) this.ring.hide();
    else this.ring.show(pointOn(leading), eye, progress);
    const shown = `${leading?.key} ${leading?.distance_m} ${progress}`;
    const isChanged = shown !== this.shown;
    this.shown = shown;
    return isChanged || grips.tracked.length > 0;
  }

  dispose(): void {
    this.ring.dispose();
  }
}
