/**
 * Files of a bundle that the page has made from a source and holds in memory. All code that reads a bundle requests them
 * by their address, like files of a host.
 */

/** Contents of files by their paths. */
export type HeldFiles = ReadonlyMap<string, Uint8Array<ArrayBuffer>>;

/** A scheme that no browser can fetch: a request that bypasses this module fails without using the network. */
const SCHEME = "held:";

const folders = new Map<string, HeldFiles>();
let last = 0;

/** Holds files from now on. Returns the address of their folder, with a closing slash. */
export function holdFiles(files: HeldFiles): string {
  const base = `${SCHEME}//${++last}/`;
  folders.set(base, files);
  return base;
}

/** Releases the files of a folder. Contents that have been read stay valid. */
export function releaseFiles(base: string): void {
  folders.delete(base);
}

/** Returns whether an address belongs to held files, or to their folder. */
export function isHeld(address: string): boolean {
  return address.startsWith(SCHEME);
}

/** The response for the address of a held file, with status 404 if there is none. */
export function heldResponse(address: string): Response {
  const { protocol, host, pathname } = new URL(address);
  const base = `${protocol}//${host}/`;
  const bytes = folders.get(base)?.get(decodeURIComponent(pathname.slice(1)));
  return bytes === undefined ? new Response(null, { status: 404 }) : new Response(bytes);
}
