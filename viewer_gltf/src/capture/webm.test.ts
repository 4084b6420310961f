import { describe, expect, it } from "vitest";
import { type EncodedFrame, writeWebm } from "./webm";

/** IDs of elements that contain other elements. */
const MASTERS = new Set([0x1a45dfa3, 0x18538067, 0x1549a966, 0x1654ae6b, 0xae, 0xe0, 0x1f43b675]);

type Found = Readonly<{ id: number; content: Uint8Array; inner: readonly Found[] }>;

/** Reads elements by the rules of EBML: the leading zeros of the first byte give the length of an ID or a length. */
function read(bytes: Uint8Array): readonly Found[] {
  const found: Found[] = [];
  for (let at = 0; at < bytes.length; ) {
    const idLength = Math.clz32(bytes[at]) - 23;
    const id = bytes.slice(at, at + idLength).reduce((sum, byte) => sum * 256 + byte, 0);
    at += idLength;
    const sizeLength = Math.clz32(bytes[at]) - 23;
    const digits = bytes.slice(at, at + sizeLength);
    digits[0] &= (1 << (8 - sizeLength)) - 1;
    const size = digits.reduce((sum, byte) => sum * 256 + byte, 0);
    at += sizeLength;
    const content = bytes.slice(at, at + size);
    expect(content.length).toBe(size);
    found.push({ id, content, inner: MASTERS.has(id) ? read(content) : [] });
    at += size;
  }
  return found;
}

const uint = ({ content }: Found) => content.reduce((sum, byte) => sum * 256 + byte, 0);
const all = (list: readonly Found[], id: number): readonly Found[] =>
  list.flatMap((each) => [...(each.id === id ? [each] : []), ...all(each.inner, id)]);

describe("a WebM file", () => {
  const frames: EncodedFrame[] = Array.from({ length: 130 }, (_, i) => ({
    data: Uint8Array.from([i, i + 1]),
    time_ms: (i * 1000) / 30,
    isKey: i % 60 === 0,
  }));
  const track = { codec: "V_VP8", width: 640, height: 360, frame_ms: 1000 / 30 };
  const file = read(writeWebm(track, frames));

  it("has a header, a duration, and a track of the given size", () => {
    expect(file.map(({ id }) => id)).toEqual([0x1a45dfa3, 0x18538067]);
    expect(new TextDecoder().decode(all(file, 0x4282)[0].content)).toBe("webm");
    expect(new TextDecoder().decode(all(file, 0x86)[0].content)).toBe("V_VP8");
    expect([uint(all(file, 0xb0)[0]), uint(all(file, 0xba)[0])]).toEqual([640, 360]);
    const duration = new DataView(all(file, 0x4489)[0].content.buffer).getFloat64(0);
    expect(duration).toBeCloseTo((130 * 1000) / 30, 6);
  });

  it("has every frame once at its time, and each cluster begins with a key frame", () => {
    const clusters = all(file, 0x1f43b675);
    expect(clusters).toHaveLength(3);
    const times = clusters.flatMap(({ inner }) => {
      const start = uint(inner[0]);
      const blocks = inner.slice(1);
      expect(blocks[0].content[3]).toBe(0x80);
      return blocks.map(({ content }) => start + new DataView(content.buffer).getInt16(1));
    });
    expect(times).toEqual(frames.map(({ time_ms }) => Math.round(time_ms)));
    const data = all(file, 0xa3).map(({ content }) => [...content.slice(4)]);
    expect(data).toEqual(frames.map(({ data }) => [...data]));
  });
});
