/** Chunks that numcodecs has packed are unpacked to the same bytes. */
import { mkdtemp, readFile, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { beforeAll, describe, expect, it } from "vitest";
import { askPython, hasPython } from "../../test/support/python";
import Blosc from "./codecs/blosc";
import Lz4 from "./codecs/lz4";
import Zstd from "./codecs/zstd";
import { unpackBloscLz, unpackLz4 } from "./unpack";

type Chunk = Readonly<{
  name: string;
  codec: "blosc" | "lz4" | "zstd";
  packed: string;
  plain: string;
}>;
const CODECS = { blosc: Blosc, lz4: Lz4, zstd: Zstd };
const bytesOf = (text: string) => Uint8Array.from(Buffer.from(text, "base64"));

describe.skipIf(!hasPython)("a packed chunk", () => {
  let chunks: readonly Chunk[];
  beforeAll(async () => {
    const folder = await mkdtemp(join(tmpdir(), "stereocell-chunks-"));
    const file = join(folder, "chunks.json");
    await askPython("packed_chunks", [file], "");
    chunks = JSON.parse(await readFile(file, "utf8"));
    await rm(folder, { recursive: true });
  }, 60_000);

  it("is unpacked for each codec, shuffle and size of value", async () => {
    expect(chunks.length).toBeGreaterThan(150);
    for (const { name, codec, packed, plain } of chunks) {
      const found = await CODECS[codec].fromConfig().decode(bytesOf(packed));
      expect(Buffer.from(found).equals(Buffer.from(plain, "base64")), name).toBe(true);
    }
  });

  it("that is damaged is refused, or unpacked to the same number of bytes", async () => {
    let refused = 0;
    for (const [i, { codec, packed, plain }] of chunks.entries()) {
      if (codec === "zstd" || !(i % 3 === 0)) continue;
      const bytes = bytesOf(packed);
      for (let at = 17; at < bytes.length; at += 1 + Math.floor(bytes.length / 5))
        bytes[at] ^= 0x5a;
      try {
        const found = await CODECS[codec].fromConfig().decode(bytes);
        expect(found.length).toBe(bytesOf(plain).length);
      } catch {
        refused++;
      }
      const cut = bytesOf(packed).subarray(0, Math.floor(bytes.length / 2));
      await expect(CODECS[codec].fromConfig().decode(cut)).rejects.toThrow();
    }
    expect(refused).toBeGreaterThan(10);
  });
});

describe("a stream", () => {
  it("may repeat bytes that it has just written, in LZ4", () => {
    // one literal, then 11 bytes copied from 1 byte back, then the last literals
    expect(String.fromCharCode(...unpackLz4(Uint8Array.of(0x17, 97, 1, 0, 0x10, 98), 13))).toBe(
      "aaaaaaaaaaaab",
    );
  });

  it.each([unpackLz4, unpackBloscLz])(
    "that leads before its own beginning is refused",
    (unpack) => {
      expect(() => unpack(Uint8Array.of(0x17, 97, 9, 0, 0x10, 98), 13)).toThrow(RangeError);
      expect(() => unpack(new Uint8Array(0), 5)).toThrow(RangeError);
    },
  );
});
