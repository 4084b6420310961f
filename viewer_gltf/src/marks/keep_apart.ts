/** Moves labels that would overlap. The later one of two moves up or down. Pure. */

/** A label's box. The unit is the height of a text line, which looks equal for all labels; y is up. */
export type LabelBox = Readonly<{
  /** The lower left corner. */
  x: number;
  y: number;
  width: number;
  height: number;
  /** Whether the label moves up, away from its point; otherwise it moves down. */
  isAbove: boolean;
}>;

/** Gap between two labels, lines. */
const GAP = 0.15;

/** Returns how far each label has to move up, in lines, so that it does not overlap an earlier one. */
export function keepApart(boxes: readonly LabelBox[]): readonly number[] {
  const placed: LabelBox[] = [];
  return boxes.map((box) => {
    let y = box.y;
    // Each step passes one earlier label, which it can't meet again.
    for (let step = 0; step <= placed.length; step++) {
      const obstacle = placed.find(
        (other) =>
          box.x < other.x + other.width &&
          other.x < box.x + box.width &&
          y < other.y + other.height + GAP - 1e-9 &&
          other.y < y + box.height + GAP - 1e-9,
      );
      if (obstacle === undefined) break;
      y = box.isAbove ? obstacle.y + obstacle.height + GAP : obstacle.y - GAP - box.height;
    }
    placed.push({ ...box, y });
    return y - box.y;
  });
}
