/** Unpacks and packs .glb files (glTF 2.0, section 4). */

const MAGIC = 0x46546c67;
const JSON_CHUNK = 0x4e4f534a;
const BIN_CHUNK = 0x004e4942;

/** Returns the document and the binary chunk, which is empty if there is none. Throws if the container is broken. */
export function unpackGlb(bytes) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  if (bytes.byteLength < 20 || view.getUint32(0, true) !== MAGIC)
    throw new Error("not a .glb file");
  if (view.getUint32(8, true) !== bytes.byteLength) throw new Error("cut short or padded");
  let document;
  let binary = new Uint8Array();
  for (let at = 12; at < bytes.byteLength; ) {
    const length = view.getUint32(at, true);
    const type = view.getUint32(at + 4, true);
    const chunk = bytes.subarray(at + 8, at + 8 + length);
    if (type === JSON_CHUNK) document = JSON.parse(new TextDecoder().decode(chunk));
    if (type === BIN_CHUNK) binary = chunk;
    at += 8 + length;
  }
  if (document === undefined) throw new Error("no JSON chunk");
  return { document, binary };
}

export function packGlb({ document, binary }) {
  const json = new TextEncoder().encode(JSON.stringify(document));
  const jsonLength = Math.ceil(json.length / 4) * 4;
  const bytes = new Uint8Array(12 + 8 + jsonLength + 8 + binary.length);
  const view = new DataView(bytes.buffer);
  [MAGIC, 2, bytes.length, jsonLength, JSON_CHUNK].forEach((word, i) => {
    view.setUint32(4 * i, word, true);
  });
  bytes.fill(0x20, 20, 20 + jsonLength);
  bytes.set(json, 20);
  view.setUint32(20 + jsonLength, binary.length, true);
  view.setUint32(24 + jsonLength, BIN_CHUNK, true);
  bytes.set(binary, 28 + jsonLength);
  return bytes;
}

/** Returns the bytes of a bufferView in the binary chunk. */
export function bytesOf(view, binary) {
  const start = view.byteOffset ?? 0;
  if (start + view.byteLength > binary.length) throw new Error("a bufferView ends past the file");
  return binary.subarray(start, start + view.byteLength);
}
