/**
 * Writes a WebM file with one video track from encoded frames. Pure.
 *
 * References: RFC 8794 (EBML), RFC 9559 (Matroska).
 */

export type EncodedFrame = Readonly<{ data: Uint8Array; time_ms: number; isKey: boolean }>;

export type VideoTrack = Readonly<{
  /** `V_VP8` or `V_VP9`. */
  codec: string;
  width: number;
  height: number;
  frame_ms: number;
}>;

type Node = Uint8Array | readonly Node[];

const NAME = "StereoCell";
/** Longest cluster, ms. Times in a block are signed 16-bit numbers, in ms from the cluster's time. */
const LONGEST_CLUSTER_MS = 30_000;

function bytesOf(node: Node): number {
  return node instanceof Uint8Array
    ? node.length
    : node.reduce((sum, each) => sum + bytesOf(each), 0);
}

/** Returns an element: its ID in encoded form, its length in 8 bytes, and its content. */
function element(id: number, ...content: readonly Node[]): Node {
  const digits = id.toString(16).match(/../g) ?? [];
  const length = new Uint8Array(8);
  new DataView(length.buffer).setBigUint64(0, BigInt(bytesOf(content)));
  length[0] = 0x01; // the first byte of EBML states that the length itself takes 8 bytes
  return [Uint8Array.from(digits.map((digit) => Number.parseInt(digit, 16))), length, content];
}

function number(id: number, value: number): Node {
  const bytes = new Uint8Array(8);
  new DataView(bytes.buffer).setBigUint64(0, BigInt(Math.round(value)));
  return element(id, bytes);
}

function real(id: number, value: number): Node {
  const bytes = new Uint8Array(8);
  new DataView(bytes.buffer).setFloat64(0, value);
  return element(id, bytes);
}

const text = (id: number, value: string) => element(id, new TextEncoder().encode(value));

/** Returns the file's parts in their order. @param frames in the order of time; the first is a key frame */
export function writeWebm(
  { codec, width, height, frame_ms }: VideoTrack,
  frames: readonly EncodedFrame[],
): Uint8Array<ArrayBuffer> {
  const head = element(
    0x1a45dfa3,
    number(0x4286, 1),
    number(0x42f7, 1),
    number(0x42f2, 4),
    number(0x42f3, 8),
    text(0x4282, "webm"),
    number(0x4287, 2),
    number(0x4285, 2),
  );
  const last = frames.at(-1)?.time_ms ?? 0;
  const info = element(
    0x1549a966,
    number(0x2ad7b1, 1e6), // ns per tick
    real(0x4489, last + frame_ms),
    text(0x4d80, NAME),
    text(0x5741, NAME),
  );
  const video = element(0xe0, number(0xb0, width), number(0xba, height));
  const track = element(
    0xae,
    number(0xd7, 1),
    number(0x73c5, 1),
    number(0x83, 1),
    text(0x86, codec),
    video,
  );
  const segment = element(0x18538067, info, element(0x1654ae6b, track), ...clusters(frames));
  return flat([head, segment]);
}

function clusters(frames: readonly EncodedFrame[]): readonly Node[] {
  const groups: EncodedFrame[][] = [];
  for (const frame of frames) {
    const open = groups.at(-1);
    const isLong = open !== undefined && frame.time_ms - open[0].time_ms > LONGEST_CLUSTER_MS;
    if (open === undefined || frame.isKey || isLong) groups.push([frame]);
    else open.push(frame);
  }
  return groups.map((group) => {
    const start = Math.round(group[0].time_ms);
    return element(0x1f43b675, number(0xe7, start), ...group.map((frame) => block(frame, start)));
  });
}

function block({ data, time_ms, isKey }: EncodedFrame, start_ms: number): Node {
  const head = new Uint8Array(4);
  head[0] = 0x81; // number of the track, 1
  new DataView(head.buffer).setInt16(1, Math.round(time_ms) - start_ms);
  head[3] = isKey ? 0x80 : 0;
  return element(0xa3, head, data);
}

function flat(node: Node): Uint8Array<ArrayBuffer> {
  const out = new Uint8Array(bytesOf(node));
  let at = 0;
  const write = (each: Node) => {
    if (each instanceof Uint8Array) {
      out.set(each, at);
      at += each.length;
    } else each.forEach(write);
  };
  write(node);
  return out;
}
