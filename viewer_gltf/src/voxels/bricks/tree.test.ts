import { describe, expect, it } from "vitest";
import { BundleError } from "../../bundle/errors";
import { SKIP_BRICK, STREAM_BRICK } from "../../bundle/generated/constants";
import { brickCounts } from "../skip_bricks";
import { BRICKS_FRAME, parseFrame } from "./protocol";
import { drawnNodes, haveBits, NOTHING, parseTable, rangesOf } from "./tree";

const hex = (text: string) =>
  Uint8Array.from(text.replaceAll(/\s/g, "").match(/../g) ?? [], (pair) =>
    Number.parseInt(pair, 16),
  );

// The example of docs/brick-stream.md, written by hand: 20 x 3 x 2 texels, threshold 40; a root of
// level 1, a leaf and an empty node. Hashes and lengths are arbitrary.
const HEADER = `89534342564 80d0a 0100 4000 10010201 14000000 03000000 02000000 03000000 02000000
  2800 0000 6400000000000000 000102030405060708090a0b0c0d0e0f`;
const ROOT = `01000398 000000000000 07c8490 00000 00000000 32000000 ${"11".repeat(16)}`;
const LEAF = `000000bc 000000000000 07c80000 0000 00000000 32000000 ${"22".repeat(16)}`;
const EMPTY = `00010007 010000000000 07070000 0000 00000000 00000000 ${"00".repeat(16)}`;
const BYTES = hex(HEADER + ROOT + LEAF + EMPTY);

describe("a brick table", () => {
  it("is read from bytes written by hand", () => {
    const table = parseTable(BYTES, "x");
    expect(table.size).toEqual([20, 3, 2]);
    expect(table.cells).toEqual([2, 1, 1]);
    expect(table.threshold).toBe(40);
    expect(table.bricks).toBe(2);
    expect(table.nodes).toEqual([
      {
        level: 1,
        isEmpty: false,
        constant: 152,
        at: [0, 0, 0],
        range: [7, 200],
        hash: "11".repeat(16),
      },
      {
        level: 0,
        isEmpty: false,
        constant: 188,
        at: [0, 0, 0],
        range: [7, 200],
        hash: "22".repeat(16),
      },
      { level: 0, isEmpty: true, constant: 7, at: [1, 0, 0], range: [7, 7], hash: "" },
    ]);
  });

  it("is rejected if it is not a table, is truncated, or is not a tree", () => {
    const changed = (at: number, value: number) => {
      const bytes = BYTES.slice();
      bytes[at] = value;
      return bytes;
    };
    for (const bytes of [
      new Uint8Array(0),
      BYTES.subarray(0, 63),
      BYTES.subarray(0, BYTES.length - 1),
      changed(0, 0),
      changed(8, 2),
      changed(12, 8),
      changed(66, 0x07), // three children where there are two
    ]) {
      expect(() => parseTable(bytes, "x")).toThrow(BundleError);
    }
  });

  it("draws each cell from the finest loaded node", () => {
    const table = parseTable(BYTES, "x");
    const drawn = (...present: number[]) => [...drawnNodes(table, Uint8Array.from(present))];
    expect(drawn(0, 0, 0)).toEqual([NOTHING, 2]); // empty nodes are known from the table
    expect(drawn(1, 0, 0)).toEqual([0, 2]);
    expect(drawn(1, 1, 0)).toEqual([1, 2]);
    const counts = brickCounts(table.size);
    const perBrick = (first: readonly number[], second: readonly number[]) =>
      Array.from({ length: counts[0] }, (_, b) => (b * SKIP_BRICK < STREAM_BRICK ? first : second));
    const ranges = rangesOf(table, drawnNodes(table, Uint8Array.of(1, 0, 0)), counts);
    expect([...ranges]).toEqual(perBrick([7, 200], [7, 7]).flat());
    const before = rangesOf(table, drawnNodes(table, new Uint8Array(3)), counts);
    expect([...before]).toEqual(perBrick([0, 0], [7, 7]).flat());
  });

  it("encodes the present bricks as bits, the first one lowest", () => {
    const present = Uint8Array.of(1, 0, 0, 0, 0, 0, 0, 1, 0, 1);
    expect([...atob(haveBits(present))].map((c) => c.charCodeAt(0))).toEqual([0x81, 0x02]);
  });
});

describe("a frame of bricks", () => {
  const FRAME = `02010000 07000000 09000000 02000000
    03000000 05000000 02000000 00000000 01010000 01000000 aabb cc`;

  it("is read from bytes written by hand", () => {
    expect(parseFrame(hex(FRAME).buffer)).toEqual({
      kind: BRICKS_FRAME,
      sequence: 7,
      parts: [
        { tree: 3, at: 5, bytes: Uint8Array.of(0xaa, 0xbb) },
        { tree: 0, at: 257, bytes: Uint8Array.of(0xcc) },
      ],
    });
  });

  it("is rejected if it is truncated, too long or of another version", () => {
    const bytes = hex(FRAME);
    for (let length = 0; length < bytes.length; length++) {
      expect(() => parseFrame(bytes.slice(0, length).buffer)).toThrow(BundleError);
    }
    expect(() => parseFrame(hex(`${FRAME}00`).buffer)).toThrow(BundleError);
    const newer = bytes.slice();
    newer[1] = 2;
    expect(() => parseFrame(newer.buffer)).toThrow(BundleError);
  });
});
