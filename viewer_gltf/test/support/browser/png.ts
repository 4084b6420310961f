/** Reads the pixels of a PNG file as Chromium writes screenshots: 8 bits per component, not interlaced. */
import { inflateSync } from "node:zlib";

const SIGNATURE_BYTES = 8;
/** Bytes of a pixel, by the colour type in the header: RGB, RGBA. */
const PARTS: Readonly<Record<number, number>> = { 2: 3, 6: 4 };

/** Predicts a byte from its left, upper and upper left neighbours (Paeth 1991, a filter of PNG). */
function paeth(a: number, b: number, c: number): number {
  const [pa, pb, pc] = [Math.abs(b - c), Math.abs(a - c), Math.abs(a + b - 2 * c)];
  return pa <= pb && pa <= pc ? a : pb <= pc ? b : c;
}

export function decodePng(png: Buffer): { width: number; height: number; rgba: Uint8Array } {
  let [width, height, parts] = [0, 0, 0];
  const packed: Buffer[] = [];
  for (let at = SIGNATURE_BYTES; at < png.length; ) {
    const length = png.readUInt32BE(at);
    const type = png.toString("latin1", at + 4, at + 8);
    const data = png.subarray(at + 8, at + 8 + length);
    if (type === "IHDR") {
      [width, height] = [data.readUInt32BE(0), data.readUInt32BE(4)];
      parts = PARTS[data[9]] ?? 0;
      if (data[8] !== 8 || parts === 0 || data[12] !== 0) throw new Error("another kind of PNG");
    } else if (type === "IDAT") packed.push(data);
    at += length + 12; // and the checksum
  }
  const rows = inflateSync(Buffer.concat(packed));
  const pitch = width * parts;
  const rgba = new Uint8Array(4 * width * height).fill(255);
  let before = new Uint8Array(pitch);
  for (let y = 0; y < height; y++) {
    const filter = rows[y * (pitch + 1)];
    const row = new Uint8Array(rows.subarray(y * (pitch + 1) + 1, (y + 1) * (pitch + 1)));
    for (let i = 0; filter !== 0 && i < pitch; i++) {
      const left = i < parts ? 0 : row[i - parts];
      const corner = i < parts ? 0 : before[i - parts];
      const up = before[i];
      if (filter === 1) row[i] += left;
      else if (filter === 2) row[i] += up;
      else if (filter === 3) row[i] += (left + up) >> 1;
      else row[i] += paeth(left, up, corner);
    }
    for (let x = 0; x < width; x++) {
      for (let part = 0; part < parts; part++) {
        rgba[4 * (y * width + x) + part] = row[x * parts + part];
      }
    }
    before = row;
  }
  return { width, height, rgba };
}
