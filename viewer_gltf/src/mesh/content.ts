/** Fetch and check what a tileset is made of: its JSON and its glb files. */
import { BundleError } from "../bundle/errors";
import { fetchFile, fileAddress, parseJson, readBody, request } from "../bundle/fetch";
import type { FileRef } from "../bundle/generated/bundle";

/** glTF 2.0, section 4.4.2: magic, version, and length of the whole file. */
const HEADER_BYTES = 12;
const MAGIC = 0x46546c67;

/** Throws BundleError unless the bytes are a whole glb by their own header. */
export function checkGlb(bytes: Uint8Array, path: string): void {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  if (bytes.length < HEADER_BYTES || view.getUint32(0, true) !== MAGIC) {
    throw new BundleError(`${path}: expected a glb surface, found another kind of file`);
  }
  const length = view.getUint32(8, true);
  if (length !== bytes.length) {
    throw new BundleError(
      `${path}: expected ${length} bytes, found ${bytes.length} (a broken upload?)`,
    );
  }
}

/** The bytes of a surface. Throws BundleError, or AbortError. */
export async function fetchGlb(
  base: string,
  path: string,
  signal?: AbortSignal | null,
): Promise<ArrayBuffer> {
  const response = await request(fileAddress(base, path), path, { signal });
  const bytes = await readBody(response, path);
  checkGlb(bytes, path);
  return bytes.buffer;
}

/** A tileset.json with a version and a root, which the renderer takes for granted. */
export function checkTileset(value: unknown, path: string): object {
  const tileset = value as { asset?: { version?: unknown }; root?: { children?: unknown } } | null;
  if (typeof tileset?.asset?.version !== "string" || !Array.isArray(tileset.root?.children)) {
    throw new BundleError(`${path}: expected a 3D Tiles tileset with asset.version and root`);
  }
  return tileset;
}

export async function fetchTileset(base: string, file: FileRef): Promise<object> {
  const text = new TextDecoder().decode(await fetchFile(base, file));
  return checkTileset(parseJson(text, file.path), file.path);
}
