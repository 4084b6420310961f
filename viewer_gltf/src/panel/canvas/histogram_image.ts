/** Histograms as images, each made once. */

import { COLUMNS, ROWS } from "../../bundle/transfer_2d";
import type { Histogram } from "../controls";

/** Colour of the largest number of voxels, sRGB, 0..255: the accent colour of the page. */
const COLOR = [150, 190, 240] as const;

const made = new WeakMap<Histogram, HTMLCanvasElement>();

/** Returns a canvas of COLUMNS x ROWS pixels, with the steepest gradient on top. */
export function histogramPicture(histogram: Histogram): HTMLCanvasElement {
  const before = made.get(histogram);
  if (before !== undefined) return before;
  const canvas = document.createElement("canvas");
  canvas.width = COLUMNS;
  canvas.height = ROWS;
  const picture = new ImageData(COLUMNS, ROWS);
  for (let row = 0; row < ROWS; row++) {
    for (let k = 0; k < COLUMNS; k++) {
      const at = 4 * ((ROWS - 1 - row) * COLUMNS + k);
      picture.data.set(COLOR, at);
      picture.data[at + 3] = histogram.cells[row * COLUMNS + k];
    }
  }
  canvas.getContext("2d")?.putImageData(picture, 0, 0);
  made.set(histogram, canvas);
  return canvas;
}
