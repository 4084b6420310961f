/** Fetches and checks the files of a tileset: its JSON, external tilesets, and glb files. */
import { BundleError } from "./errors";
import { fetchFile, fileAddress, parseJson, readBody, request } from "./fetch";
import type { FileRef } from "./generated/bundle";
import { checkHash, SHA_256_128 } from "./hash";

/** glTF 2.0, section 4.4.2: magic, version, and length of the whole file. */
const HEADER_BYTES = 12;
const MAGIC = 0x46546c67;

/** Throws BundleError unless the bytes are a whole glb file according to its header. */
export function checkGlb(bytes: Uint8Array, path: string): void {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  if (bytes.length < HEADER_BYTES || view.getUint32(0, true) !== MAGIC) {
    throw new BundleError(`${path}: found another kind of file, expected a glb surface`);
  }
  const length = view.getUint32(8, true);
  if (length !== bytes.length) {
    throw new BundleError(
      `${path}: found ${bytes.length} bytes, expected ${length}: upload the file again`,
    );
  }
}

/** Returns the bytes of a surface, whose `hash` is in its tileset. Throws BundleError, or AbortError. */
async function fetchGlb(
  base: string,
  path: string,
  hash: string,
  signal?: AbortSignal | null,
): Promise<ArrayBuffer> {
  const response = await request(fileAddress(base, path), path, { signal });
  const bytes = await readBody(response, path);
  checkGlb(bytes, path); // before the hash, because the message for an incomplete file is clearer
  await checkHash(path, bytes, hash, SHA_256_128);
  return bytes.buffer;
}

type TileJson = Readonly<{
  content?: Readonly<{ uri?: unknown; extras?: Readonly<Record<string, unknown>> }>;
  children?: readonly TileJson[];
}>;

/** The part of a tileset.json that the viewer itself reads; the renderer reads the rest. */
export type Tileset = Readonly<{ asset: Readonly<{ version: string }>; root: TileJson }>;

/** Checks that a tileset.json has a version and a root, which the renderer requires, and returns it. */
export function checkTileset(value: unknown, path: string): Tileset {
  const tileset = value as { asset?: { version?: unknown }; root?: { children?: unknown } } | null;
  const { root } = tileset ?? {};
  const isTile = typeof root === "object" && root !== null && Array.isArray(root.children ?? []);
  if (typeof tileset?.asset?.version !== "string" || !isTile) {
    throw new BundleError(
      `${path}: found JSON without asset.version or root, expected a 3D Tiles tileset`,
    );
  }
  return tileset as Tileset;
}

/**
 * Returns the hashes of all files that a tileset names (surfaces and external tilesets) by the files' addresses.
 * `address` is the tileset's own address. Throws BundleError.
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

async function fetchTileset(base: string, file: FileRef): Promise<Tileset> {
  const text = new TextDecoder().decode(await fetchFile(base, file));
  return checkTileset(parseJson(text, file.path), file.path);
}

/** Returns an external tileset, whose `hash` is in the tileset that names it. Throws BundleError, or AbortError. */
async function fetchExternal(
  base: string,
  path: string,
  hash: string,
  signal?: AbortSignal | null,
): Promise<Tileset> {
  const response = await request(fileAddress(base, path), path, { signal });
  const bytes = await readBody(response, path);
  // The content is checked before the hash, since that gives a clearer message for a host's error page.
  const tileset = checkTileset(parseJson(new TextDecoder().decode(bytes), path), path);
  await checkHash(path, bytes, hash, SHA_256_128);
  return tileset;
}

/**
 * The files of one channel's tileset, by the addresses that the renderer requests. These lack the query of the bundle's
 * address, which is added to each request (see fileAddress). A file can be fetched once a tileset that states its hash
 * has been read.
 */
export class TilesetFiles {
  /** Address of the channel's tileset.json. */
  readonly root: string;
  private readonly folder: string;
  private readonly hashes = new Map<string, string>();

  constructor(
    private readonly base: string,
    private readonly file: FileRef,
  ) {
    this.folder = new URL(".", base).href.split("?")[0];
    this.root = new URL(file.path, this.folder).href;
  }

  /** Returns a file's path in the bundle. */
  nameOf(address: string): string {
    return decodeURIComponent(address.replace(this.folder, ""));
  }

  /** Returns a tileset, or the bytes of a surface. Throws BundleError, or AbortError. */
  async fetch(address: string, signal?: AbortSignal | null): Promise<Tileset | ArrayBuffer> {
    const { base, file } = this;
    if (address === this.root) return this.readHashes(await fetchTileset(base, file), address);
    const hash = this.hashes.get(address);
    if (hash === undefined) throw new Error(`${address} is not in its tileset`);
    const path = this.nameOf(address);
    if (!path.endsWith(".json")) return fetchGlb(base, path, hash, signal);
    return this.readHashes(await fetchExternal(base, path, hash, signal), address);
  }

  private readHashes(tileset: Tileset, address: string): Tileset {
    const found = contentHashes(tileset, this.nameOf(address), address);
    for (const [each, hash] of found) this.hashes.set(each, hash);
    // The renderer warns about version 1.1. A bundle uses only one new feature of it, glTF content, which works.
    return { ...tileset, asset: { ...tileset.asset, version: "1.0" } };
  }
}
