/** Decompresses and interleaves the textures of up to four channels, in a worker. */
import { ZSTDDecoder } from "zstddec";
import { cellRanges } from "./cell_ranges";
import type { DecodeAnswer, DecodeRequest } from "./decode";

const decoder = new ZSTDDecoder();
const ready = decoder.init();

class PartFault extends Error {
  constructor(
    readonly part: number,
    text: string,
  ) {
    super(text);
  }
}

function unzstd(frame: Uint8Array, bytes: number, part: number): Uint8Array {
  let decoded: Uint8Array;
  try {
    decoded = decoder.decode(frame, bytes);
  } catch {
    throw new PartFault(part, "found a damaged zstd stream");
  }
  if (decoded.length === bytes) return decoded;
  throw new PartFault(part, `found ${decoded.length} texel bytes, expected ${bytes}`);
}

function interleave(decoded: readonly Uint8Array[], bytes: number): Uint8Array<ArrayBuffer> {
  if (decoded.length === 1) return decoded[0] as Uint8Array<ArrayBuffer>; // already a copy, which can be transferred
  // Three channels take four bytes, since textures of three bytes are slow on some devices.
  const stride = decoded.length === 2 ? 2 : 4;
  const packed = new Uint8Array(bytes * stride);
  decoded.forEach((each, c) => {
    for (let i = 0, at = c; i < bytes; i++, at += stride) packed[at] = each[i];
  });
  return packed;
}

async function decode({ id, parts, bytes, size }: DecodeRequest): Promise<DecodeAnswer> {
  await ready;
  const decoded = parts.map((part, i) => unzstd(part, bytes, i));
  const cells = size === undefined ? [] : decoded.map((each) => cellRanges(each, size));
  return { id, texels: interleave(decoded, bytes), cells };
}

addEventListener("message", async ({ data }: MessageEvent<DecodeRequest>) => {
  let answer: DecodeAnswer;
  try {
    answer = await decode(data);
  } catch (error) {
    const part = error instanceof PartFault ? error.part : 0;
    answer = { id: data.id, fault: error instanceof Error ? error.message : String(error), part };
  }
  const { texels, cells = [] } = answer;
  const arrays = texels === undefined ? [] : [texels, ...cells];
  postMessage(answer, { transfer: arrays.map(({ buffer }) => buffer) });
});
