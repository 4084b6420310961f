/**
 * The scale bar of a headset: a ruler of round length that lies under the specimen and turns and
 * grows with it. um, world.
 */
import { BoxGeometry, Object3D, Vector3 } from "three";
import type { Box } from "../math/box";
import { chooseScaleBar, LONGEST_PX } from "../math/round_length";
import { Label } from "./label";
import { DIM, disposeMarks, lengthAt, MARKS_ORDER, markMesh, type Sight } from "./style";

/** Angle under which the user sees the longest ruler, radians. */
const LONGEST_RAD = (16 * Math.PI) / 180;
const THICKNESS_RAD = (0.25 * Math.PI) / 180;
/** Gap between specimen and ruler, as a share of the specimen's longest edge. */
const GAP = 0.06;
/** Parts of the ruler, every second one dark: five parts distinguish lengths of 1, 2 and 5. */
const PARTS = 5;

/** A round length for a ruler at a distance, um. */
export function rulerLength(distance_um: number): { length_um: number; label: string } | null {
  return chooseScaleBar((2 * distance_um * Math.tan(LONGEST_RAD / 2)) / LONGEST_PX);
}

export class Ruler {
  readonly group = new Object3D();
  length_um = 0;
  private readonly bar = new Object3D();
  private readonly label = new Label("below");
  private readonly at = new Vector3();

  constructor() {
    for (let i = 0; i < PARTS; i++) {
      const part = markMesh(PART, i % 2 === 0 ? 0xffffff : DIM, i % 2 === 0 ? 1 : 0.35);
      part.position.x = (i + 0.5) / PARTS - 0.5;
      this.bar.add(part);
    }
    for (const side of [-0.5, 0.5]) {
      const tick = markMesh(TICK, 0xffffff);
      tick.position.x = side;
      tick.renderOrder = MARKS_ORDER + 1;
      this.bar.add(tick);
    }
    this.group.add(this.bar, this.label.sprite);
  }

  /** Under the front edge of the box of what is shown. */
  update(shown: Box, sight: Sight): void {
    const { min, max } = shown;
    const gap = GAP * Math.max(max[0] - min[0], max[1] - min[1], max[2] - min[2]);
    this.at.set((min[0] + max[0]) / 2, min[1] - gap, max[2]);
    const chosen = rulerLength(this.at.distanceTo(sight.eye_um));
    this.group.visible = chosen !== null;
    if (chosen === null) return;
    this.length_um = chosen.length_um;
    const thickness = lengthAt(this.at, sight, THICKNESS_RAD);
    this.bar.position.copy(this.at);
    this.bar.scale.set(chosen.length_um, thickness, thickness);
    for (const tick of this.bar.children.slice(PARTS)) tick.scale.x = thickness / chosen.length_um;
    this.label.write(chosen.label);
    this.label.place(this.at, sight);
  }

  dispose(): void {
    this.group.removeFromParent();
    this.label.dispose();
    disposeMarks(this.bar);
  }
}

const PART = new BoxGeometry(1 / PARTS, 1, 1);
const TICK = new BoxGeometry(0.5, 3.2, 0.5);
