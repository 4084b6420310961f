/** Pieces that all blocks of the panel share. Pixels. Pure. */
import type { Control } from "../controls";
import { type Block, type Mark, type Rect, type Region, ROW, SMALL, text } from "./draw_list";

/** Width of a control's label, as a share of their row. */
export const LABEL = 0.27;
/** Height of a caption above a row, px. */
const CAPTION = 52;

export function one(marks: readonly Mark[], regions: readonly Region[], height = ROW): Block {
  return { height, marks, regions };
}

export function region(
  id: string,
  label: string,
  rect: Rect,
  to: Region["to"],
  isSlide = false,
): Region {
  return { id, label, rect, to, isSlide };
}

/** Returns regions that report the refusal of a control instead of what they do otherwise. */
export function unlessRefused(
  { refusal }: Pick<Control, "refusal">,
  regions: readonly Region[],
): readonly Region[] {
  if (!refusal) return regions;
  const to = () => ({ canvas: "announce", text: refusal }) as const;
  return regions.map(({ press: _, repeats: __, ...each }) => ({ ...each, isSlide: false, to }));
}

export function toneOf({ refusal }: Pick<Control, "refusal">, isOnAccent = false) {
  if (refusal) return "dim";
  return isOnAccent ? "ink" : "text";
}

export function captioned(caption: string, width: number, below: Block): Block {
  const over: Rect = { x: 0, y: 0, width, height: CAPTION };
  const down = (rect: Rect): Rect => ({ ...rect, y: rect.y + CAPTION });
  return {
    ...below,
    height: CAPTION + below.height,
    marks: [
      text(over, caption, { tone: "dim", size: SMALL }),
      ...below.marks.map((mark) => ({ ...mark, rect: down(mark.rect) })),
    ],
    regions: below.regions.map((each) => ({ ...each, rect: down(each.rect) })),
  };
}
