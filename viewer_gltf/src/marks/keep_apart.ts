/** Labels that would lie over one another: the later ones give way, up or down. Pure. */

/** In lines of a label, y up: all labels' lines are of one height to the eye. */
export type LabelBox = Readonly<{
  /** The lower left corner. */
  x: number;
  y: number;
  width: number;
  height: number;
  /** Where it goes to from its point. */
  isAbove: boolean;
}>;

/** Between two labels, lines. */
const GAP = 0.15;

/** How far each has to go, lines up, so that none lies over one before it. */
export function keepApart(boxes: readonly LabelBox[]): readonly number[] {
  const placed: LabelBox[] = [];
  return boxes.map((box) => {
    let y = box.y;
    // each step leaves one behind that it will not meet again
    for (let step = 0; step <= placed.length; step++) {
      const met = placed.find(
        (other) =>
          box.x < other.x + other.width &&
          other.x < box.x + box.width &&
          y < other.y + other.height + GAP - 1e-9 &&
          other.y < y + box.height + GAP - 1e-9,
      );
      if (met === undefined) break;
      y = box.isAbove ? met.y + met.height + GAP : met.y - GAP - box.height;
    }
    placed.push({ ...box, y });
    return y - box.y;
  });
}
