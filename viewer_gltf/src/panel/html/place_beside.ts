/** Places a card beside a point of the view without covering it. Pure. */

export type Size = Readonly<{ width: number; height: number }>;
export type Point = Readonly<{ x: number; y: number }>;

/** Space between the point and the card, px: the radius of a fingertip. */
export const GAP_PX = 20;
/** Space between the card and the edges of its area, px. */
const MARGIN_PX = 8;

/**
 * Returns the upper left corner of a card beside a point: to the right of it, else to the left,
 * below or above. If the area has no space on any side, the card goes to the corner that is
 * farthest from the point.
 *
 * @param place point in the area, px from the upper left
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
