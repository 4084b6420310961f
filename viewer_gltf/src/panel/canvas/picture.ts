/** Draws on the panel's canvas a picture whose content another part of the viewer makes. Pure. */
import type { Picture } from "../controls";
import type { Block, Rect } from "./draw_list";
import { captioned, one, region, unlessRefused } from "./parts";

/** Largest height, px, which fits on a page. */
const TALLEST = 480;
/** Space at both sides, px. */
const PAD = 16;

export function pictureBlock(picture: Picture, width: number): Block {
  const { id, label, version, draw, press, drag } = picture;
  const height = Math.min(TALLEST, Math.round((width - 2 * PAD) * picture.height));
  const rect: Rect = { x: PAD, y: 0, width: width - 2 * PAD, height };
  const isSlide = drag !== undefined;
  const place = region(id, label, rect, (x, y = 0) => (drag ?? press)(x, y), isSlide);
  const block = one(
    [{ kind: "picture", rect, version, draw }],
    unlessRefused(picture, [isSlide ? { ...place, press } : place]),
    height,
  );
  return captioned(label, width, block);
}
