/** Fetch and check what a tileset is made of: its JSON, external ones too, and its glb files. */
import { BundleError } from "./errors";
import { fetchFile, fileAddress, parseJson, readBody, request } from "./fetch";
import type { FileRef } from "./generated/bundle";
import { checkHash, SHA_256_128 } from "./hash";

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

/** The bytes of a surface; its tileset gave `hash`. Throws BundleError, or AbortError. */
async function fetchGlb(
  base: string,
  path: string,
  hash: string,
  signal?: AbortSignal | null,
): Promise<ArrayBuffer> {
  const response = await request(fileAddress(base, path), path, { signal });
  const bytes = await readBody(response, path);
  checkGlb(bytes, path); // describes a file cut short better than its hash
  await checkHash(path, bytes, hash, SHA_256_128);
  return bytes.buffer;
}

type TileJson = Readonly<{
  content?: Readonly<{ uri?: unknown; extras?: Readonly<Record<string, unknown>> }>;
  children?: readonly TileJson[];
}>;

/** The part of a tileset.json that the viewer reads itself; the renderer knows the rest. */
export type Tileset = Readonly<{ asset: Readonly<{ version: string }>; root: TileJson }>;

/** A tileset.json with a version and a root, which the renderer takes for granted. */
export function checkTileset(value: unknown, path: string): Tileset {
  const tileset = value as { asset?: { version?: unknown }; root?: { children?: unknown } } | null;
  const { root } = tileset ?? {};
  const isTile = typeof root === "object" && root !== null && Array.isArray(root.children ?? []);
  if (typeof tileset?.asset?.version !== "string" || !isTile) {
    throw new BundleError(`${path}: expected a 3D Tiles tileset with asset.version and root`);
  }
  return tileset as Tileset;
}

/**
 * The hash of every file that a tileset names, surface or external tileset, by the file's address;
 * `address` is the tileset's own. Throws BundleError.
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

/** An external tileset; the one above it gave `hash`. Throws BundleError, or AbortError. */
async function fetchExternal(
  base: string,
  path: string,
  hash: string,
  signal?: AbortSignal | null,
): Promise<Tileset> {
  const response = await request(fileAddress(base, path), path, { signal });
  const bytes = await readBody(response, path);
  // describes a host's error page better than its hash
  const tileset = checkTileset(parseJson(new TextDecoder().decode(bytes), path), path);
  await checkHash(path, bytes, hash, SHA_256_128);
  return tileset;
}

/**
 * The files of one channel's tileset, by the addresses that the renderer asks for: those of the
 * bundle without its query, which goes with every request (see fileAddress). A file is known by its
 * hash once a tileset that names it has come.
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

  /** A file's path in the bundle. */
  nameOf(address: string): string {
    return decodeURIComponent(address.replace(this.folder, ""));
  }

  /** A tileset, or the bytes of a surface. Throws BundleError, or AbortError. */
  async fetch(address: string, signal?: AbortSignal | null): Promise<Tileset | ArrayBuffer> {
    const { base, file } = this;
    if (address === this.root) return this.learn(await fetchTileset(base, file), address);
    const hash = this.hashes.get(address);
    if (hash === undefined) throw new Error(`${address} is not in its tileset`);
    const path = this.nameOf(address);
    if (!path.endsWith(".json")) return fetchGlb(base, path, hash, signal);
    return this.learn(await fetchExternal(base, path, hash, signal), address);
  }

  private learn(tileset: Tileset, address: string): Tileset {
    const found = contentHashes(tileset, this.nameOf(address), address);
    for (const [each, hash] of found) this.hashes.set(each, hash);
    // of 1.1 the renderer warns; it knows all that is new there in a bundle: glTF as content
    return { ...tileset, asset: { ...tileset.asset, version: "1.0" } };
  }
}
