import { expect, it } from "vitest";
import {
  byteAt,
  categoryAt,
  countBytes,
  inLasso,
  legendOf,
  numberText,
  placeOf,
  ROWS_OF_LEGEND,
  unitText,
} from "./pictures";
import { sampleContent } from "./sample_table";

it("the histogram of a column counts the bytes of all rows, and of the shown rows", () => {
  const [all, left] = countBytes(Uint8Array.of(0, 1, 1, 255), Uint8Array.of(1, 0, 3, 1));
  expect([all[0], all[1], all[255]]).toEqual([1, 2, 1]);
  expect([left[0], left[1], left[255]]).toEqual([1, 1, 1]);
});

it("a byte is converted to its position in the picture and back", () => {
  for (const byte of [1, 2, 100, 255]) expect(byteAt(placeOf(byte))).toBe(byte);
  expect([byteAt(-1), byteAt(2)]).toEqual([1, 255]);
});

it("finds the category of a row, where the last row is for objects without a category", () => {
  const column = sampleContent().columns[1];
  const { indices } = legendOf(column, true, 0);
  expect([0, 0.4, 0.7, 1].map((down) => categoryAt(indices, down))).toEqual([0, 1, -1, -1]);
  expect(legendOf(column, false, 0).indices).toEqual([0, 1]);
});

it("splits a legend of many categories into pages, with each category once", () => {
  const organs = { categories: Array.from({ length: 117 }, (_, i) => `organ ${i}`) };
  const pages = Array.from({ length: 12 }, (_, page) => legendOf(organs, true, page));
  expect(pages.flatMap(({ indices }) => indices)).toEqual([...Array(117).keys(), -1]);
  expect(Math.max(...pages.map(({ indices }) => indices.length))).toBe(ROWS_OF_LEGEND);
  expect(legendOf(organs, true, 99)).toEqual(pages[11]);
  expect(legendOf({}, false, 3)).toEqual({ indices: [], page: 0, pages: 1, count: 0 });
});

it("a lasso selects the points inside it that are shown and have both values", () => {
  const xs = Uint8Array.of(128, 1, 128, 0, 128);
  const ys = Uint8Array.of(128, 1, 200, 128, 128);
  const flags = Uint8Array.of(1, 1, 1, 1, 0);
  const middle = [
    [0.4, 0.4],
    [0.6, 0.4],
    [0.6, 0.6],
    [0.4, 0.6],
  ] as const;
  expect(inLasso(middle, flags, [xs, ys])).toEqual([0]);
  const upper = middle.map(([x, y]) => [x, y - 0.3] as const); // up is smaller
  expect(inLasso(upper, flags, [xs, ys])).toEqual([2]);
});

it("writes numbers with three digits, and units with their symbols", () => {
  const texts = [0, 1.2345, 12.345, 123.45, 12345.6, 1.5e7, 0.000123, -4.5, Number.NaN];
  expect(texts.map(numberText)).toEqual([
    ...["0", "1.23", "12.3", "123", "12 346", "1.50e7", "1.23e-4", "-4.5", ""],
  ]);
  expect(["um", "um2", "um3", "counts"].map(unitText)).toEqual(["µm", "µm²", "µm³", "counts"]);
});
