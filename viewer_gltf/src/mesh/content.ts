/** Fetch and check what a tileset is made of: its JSON and its glb files. */
import { BundleError } from "../bundle/errors";
import { fetchFile, fileAddress, parseJson, readBody, request } from "../bundle/fetch";
import type { FileRef } from "../bundle/generated/bundle";
import { checkHash, SHA_256_128 } from "../bundle/hash";

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

/** The bytes of a surface, whose hash its tileset gave. Throws BundleError, or AbortError. */
export async function fetchGlb(
  base: string,
  path: string,
  hash: string,
  signal?: AbortSignal | null,
): Promise<ArrayBuffer> {
  const response = await request(fileAddress(base, path), path, { signal });
  const bytes = await readBody(response, path);
  checkGlb(bytes, path); // says more of a file cut short than its hash
  await checkHash(path, bytes, hash, SHA_256_128);
  return bytes.buffer;
}

type TileJson = Readonly<{
  content?: Readonly<{ uri?: unknown; extras?: Readonly<Record<string, unknown>> }>;
  children?: readonly TileJson[];
}>;

/** What the viewer reads of a tileset.json by itself; the renderer knows the rest. */
export type Tileset = Readonly<{ asset: Readonly<{ version: string }>; root: TileJson }>;

/** A tileset.json with a version and a root, which the renderer takes for granted. */
export function checkTileset(value: unknown, path: string): Tileset {
  const tileset = value as { asset?: { version?: unknown }; root?: { children?: unknown } } | null;
  if (typeof tileset?.asset?.version !== "string" || !Array.isArray(tileset.root?.children)) {
    throw new BundleError(`${path}: expected a 3D Tiles tileset with asset.version and root`);
  }
  return tileset as Tileset;
}

/**
 * The hash of every surface that a tileset names, by the surface's address; `address` is the
 * tileset's own. Throws BundleError.
 */
export function contentHashes(
  { root }: Tileset,
  path: string,
  address: string,
): ReadonlyMap<string, string> {
  const hashes = new Map<string, string>();
  const visit = ({ content, children }: TileJson): void => {
    if (content !== undefined) {
      const hash = content.extras?.[SHA_256_128.name];
      if (typeof hash !== "string") {
        throw new BundleError(
          `${path}: ${content.uri} has no hash, expected extras.${SHA_256_128.name}`,
        );
      }
      hashes.set(new URL(String(content.uri), address).href, hash);
    }
    children?.forEach(visit);
  };
  visit(root);
  return hashes;
}

export async function fetchTileset(base: string, file: FileRef): Promise<Tileset> {
  const text = new TextDecoder().decode(await fetchFile(base, file));
  return checkTileset(parseJson(text, file.path), file.path);
}
