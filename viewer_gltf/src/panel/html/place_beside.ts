/** Where a card lies beside a place of the picture, without covering it. Pure. */

export type Size = Readonly<{ width: number; height: number }>;
export type Point = Readonly<{ x: number; y: number }>;

/** Space between the place and the card, px: a fingertip's radius. */
export const GAP_PX = 20;
/** Space between the card and the edges of its area, px. */
const MARGIN_PX = 8;

/**
 * The upper left corner of a card beside a place: to the right of it, else to the left, below or above. Where the
 * area has room on no side, the card lies in the corner that is farthest from the place.
 *
 * @param place within the area, px from the upper left
 */
export function placeBeside({ x, y }: Point, card: Size, area: Size): Point {
  const most = {
    x: Math.max(MARGIN_PX, area.width - MARGIN_PX - card.width),
    y: Math.max(MARGIN_PX, area.height - MARGIN_PX - card.height),
  };
  const within = (at: number, end: number) => Math.min(end, Math.max(MARGIN_PX, at));
  const beside = within(y - card.height / 2, most.y);
  const along = within(x - card.width / 2, most.x);
  const sides = [
    { x: x + GAP_PX, y: beside },
    { x: x - GAP_PX - card.width, y: beside },
    { x: along, y: y + GAP_PX },
    { x: along, y: y - GAP_PX - card.height },
  ];
  const hasRoom = (at: Point) =>
    at.x >= MARGIN_PX && at.x <= most.x && at.y >= MARGIN_PX && at.y <= most.y;
  return (
    sides.find(hasRoom) ?? {
      x: x < area.width / 2 ? most.x : MARGIN_PX,
      y: y < area.height / 2 ? most.y : MARGIN_PX,
    }
  );
}
