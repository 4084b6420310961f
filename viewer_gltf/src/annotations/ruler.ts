/**
 * The scale bar of a headset: a ruler of round length below or above the specimen. It is a child of the specimen,
 * in um, so it turns and grows with it.
 */
import { BoxGeometry, Object3D, Vector3 } from "three";
import { Label } from "../marks/label";
import {
  BRIGHT,
  DIM,
  disposeMarks,
  type EyeView,
  lengthAt,
  markOf,
  type Piece,
} from "../marks/style";
import type { Box } from "../math/box";
import { chooseScaleBar, LONGEST_PX } from "../math/round_length";

/** Largest angle that the ruler may fill in the user's view, radians. */
const LONGEST_RAD = (16 * Math.PI) / 180;
const THICKNESS_RAD = (0.25 * Math.PI) / 180;
/** Gap between specimen and ruler, as a share of the specimen's longest edge. */
const GAP = 0.06;
/** Parts of the ruler, every second one dark: five parts distinguish lengths of 1, 2 and 5. */
const PARTS = 5;

/** Width of the ticks at the ruler's ends, as a share of its length. */
const TICK = 0.012;

/** Returns a round length for a ruler at a distance in um; null: no round length suits that distance. */
export function rulerLength(distance_um: number): { length_um: number; label: string } | null {
  return chooseScaleBar((2 * distance_um * Math.tan(LONGEST_RAD / 2)) / LONGEST_PX);
}

export class Ruler {
  readonly group = new Object3D();
  length_um = 0;
  private readonly bar = markOf([...ticks(), ...parts()]);
  private readonly label = new Label("below");
  private readonly at = new Vector3();

  constructor() {
    this.group.add(this.bar, this.label.sprite);
  }

  /**
   * Places the ruler below the front edge of a box, or above it if something else hangs below.
   *
   * @param shown box of the shown specimen, um
   */
  update(shown: Box, eyeView: EyeView, isAbove = false): void {
    const { min, max } = shown;
    const gap = GAP * Math.max(max[0] - min[0], max[1] - min[1], max[2] - min[2]);
    this.at.set((min[0] + max[0]) / 2, isAbove ? max[1] + gap : min[1] - gap, max[2]);
    this.label.turnTo(isAbove ? "above" : "below");
    const chosen = rulerLength(this.at.distanceTo(eyeView.eye_um));
    this.group.visible = chosen !== null;
    if (chosen === null) return;
    this.length_um = chosen.length_um;
    const thickness = lengthAt(this.at, eyeView, THICKNESS_RAD);
    this.bar.position.copy(this.at);
    this.bar.scale.set(chosen.length_um, thickness, thickness);
    this.label.write(chosen.label);
    this.label.place(this.at, eyeView);
  }

  dispose(): void {
    this.group.removeFromParent();
    this.label.dispose();
    disposeMarks(this.bar);
  }
}

/** The parts of a ruler with length and thickness 1, centred at the origin. */
function parts(): readonly Piece[] {
  return Array.from({ length: PARTS }, (_, i) => {
    const geometry = new BoxGeometry(1 / PARTS, 1, 1).translate((i + 0.5) / PARTS - 0.5, 0, 0);
    return i % 2 === 0 ? { geometry, color: BRIGHT } : { geometry, color: DIM, opacity: 0.35 };
  });
}

function ticks(): readonly Piece[] {
  return [-0.5, 0.5].map((x) => ({
    geometry: new BoxGeometry(TICK, 3.2, 0.5).translate(x, 0, 0),
    color: BRIGHT,
  }));
}
