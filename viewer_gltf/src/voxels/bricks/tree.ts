/**
 * A tree of bricks, read from its table; see docs/brick-stream.md.
 *
 * Nodes are stored breadth first. A cell is the box of one leaf. It is drawn from the finest loaded
 * node, or from the constant of an empty node.
 */
import { BundleError } from "../../bundle/errors";
import { SKIP_BRICK, STREAM_BRICK } from "../../bundle/generated/constants";
import type { Size3 } from "../../bundle/ktx2";

/** Texels along an edge of a node's stored brick, including its apron. */
export const STORED = STREAM_BRICK + 2;
export const STORED_BYTES = STORED ** 3;
const MAGIC = [0x89, 0x53, 0x43, 0x42, 0x56, 0x48, 0x0d, 0x0a];
const VERSION = 1;
const HEADER = 64;
const RECORD = 40;
const EMPTY = 1;

type Node = Readonly<{
  level: number;
  isEmpty: boolean;
  /** The value, 0..255, that all voxels of an empty node have. */
  constant: number;
  at: Size3;
  /** Range of all values that are sampled in the node's box, from its brick or from finer ones. */
  range: readonly [number, number];
  /** Hash of its brick, hexadecimal; "" if it is empty. */
  hash: string;
}>;

export type Table = Readonly<{
  /** Texels of the volume, including its apron. */
  size: Size3;
  /** Leaves along x, y, z. */
  cells: Size3;
  threshold: number;
  nodes: readonly Node[];
  bricks: number;
}>;

/** Reads a brick table. Throws BundleError. */
export function parseTable(bytes: Uint8Array, name: string): Table {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const isTable = bytes.length >= HEADER && MAGIC.every((value, i) => bytes[i] === value);
  if (!isTable || view.getUint16(8, true) !== VERSION || view.getUint16(10, true) !== HEADER) {
    throw new BundleError(`${name}: not a brick table of version ${VERSION}`);
  }
  const size: Size3 = [0, 1, 2].map((k) => view.getUint32(16 + 4 * k, true)) as [
    number,
    number,
    number,
  ];
  const count = view.getUint32(28, true);
  if (bytes[12] !== STREAM_BRICK || bytes[13] !== 1 || bytes[15] !== 1) {
    throw new BundleError(
      `${name}: bricks have another format, expected ${STREAM_BRICK} texels with an apron of 1, zstd`,
    );
  }
  if (bytes.length !== HEADER + count * RECORD) {
    throw new BundleError(
      `${name}: table has ${bytes.length} bytes, expected ${HEADER + count * RECORD}`,
    );
  }
  const nodes: Node[] = [];
  let next = 1;
  for (let n = 0; n < count; n++) {
    const at = HEADER + n * RECORD;
    const isEmpty = (bytes[at + 1] & EMPTY) !== 0;
    const hash = isEmpty ? "" : hexOf(bytes.subarray(at + 24, at + 40));
    nodes.push({
      level: bytes[at],
      isEmpty,
      constant: bytes[at + 3],
      at: [0, 1, 2].map((k) => view.getUint16(at + 4 + 2 * k, true)) as [number, number, number],
      range: [bytes[at + 10], bytes[at + 11]],
      hash,
    });
    next += bitsOf(bytes[at + 2]);
  }
  if (next !== count) throw new BundleError(`${name}: its nodes do not form a tree`);
  const cells = size.map((n) => Math.ceil(n / STREAM_BRICK)) as [number, number, number];
  const threshold = view.getInt16(36, true);
  return { size, cells, threshold, nodes, bricks: view.getUint32(32, true) };
}

export function hexOf(bytes: Uint8Array): string {
  return Array.from(bytes, (value) => value.toString(16).padStart(2, "0")).join("");
}

function bitsOf(mask: number): number {
  let count = 0;
  for (let rest = mask; rest !== 0; rest &= rest - 1) count++;
  return count;
}

/** Encodes a set of nodes as in the message `have`. */
export function haveBits(present: Uint8Array): string {
  const bits = new Uint8Array(Math.ceil(present.length / 8));
  present.forEach((is, n) => {
    if (is !== 0) bits[n >> 3] |= 1 << (n & 7);
  });
  let text = "";
  for (const byte of bits) text += String.fromCharCode(byte);
  return btoa(text);
}

/** Marks a cell that cannot be drawn from any node. */
export const NOTHING = 0xffffffff;

/**
 * Returns for each cell (x fastest) the finest node from which it can be drawn, one with a loaded
 * brick or an empty one; NOTHING if there is none.
 *
 * @param present one byte for each node: whether its brick is loaded
 */
export function drawnNodes({ cells, nodes }: Table, present: Uint8Array): Uint32Array {
  const drawn = new Uint32Array(cells[0] * cells[1] * cells[2]).fill(NOTHING);
  // breadth first: finer nodes come later and replace their parents' cells
  nodes.forEach((node, n) => {
    if (!node.isEmpty && present[n] === 0) return;
    const edge = 1 << node.level;
    const [x0, y0, z0] = node.at.map((v) => v * edge);
    const [x1, y1, z1] = [x0, y0, z0].map((v, k) => Math.min(cells[k], v + edge));
    for (let z = z0; z < z1; z++) {
      for (let y = y0; y < y1; y++) {
        const row = (z * cells[1] + y) * cells[0];
        drawn.fill(n, row + x0, row + x1);
      }
    }
  });
  return drawn;
}

/**
 * Smallest and largest intensity of each brick of SKIP_BRICK^3 texels in the drawn nodes,
 * interleaved, as the tables of the march and the path tracer need them.
 */
export function rangesOf(
  { cells, nodes }: Table,
  drawn: Uint32Array,
  counts: Size3,
): Uint8Array<ArrayBuffer> {
  const ranges = new Uint8Array(2 * counts[0] * counts[1] * counts[2]);
  const cellOf = (brick: number) => Math.floor((brick * SKIP_BRICK) / STREAM_BRICK);
  let to = 0;
  for (let z = 0; z < counts[2]; z++) {
    for (let y = 0; y < counts[1]; y++) {
      const row = (cellOf(z) * cells[1] + cellOf(y)) * cells[0];
      for (let x = 0; x < counts[0]; x++, to += 2) {
        const n = drawn[row + cellOf(x)];
        const [low, high] = n === NOTHING ? [0, 0] : nodes[n].range;
        ranges[to] = low;
        ranges[to + 1] = high;
      }
    }
  }
  return ranges;
}
