/**
 * Files of a bundle that the page itself holds: it has made them of a source, and no host has them. All that reads a
 * bundle asks for them by their address, as for files of a host.
 */

/** The contents of files by their paths. */
export type HeldFiles = ReadonlyMap<string, Uint8Array<ArrayBuffer>>;

/** A scheme that no browser fetches: an address that is asked for past the page fails, and leaves the machine alone. */
const SCHEME = "held:";

const folders = new Map<string, HeldFiles>();
let last = 0;

/** Holds files from now on. Returns the address of their folder, with a closing slash. */
export function holdFiles(files: HeldFiles): string {
  const base = `${SCHEME}//${++last}/`;
  folders.set(base, files);
  return base;
}

/** Lets go of the files of a folder; what has been read stays valid. */
export function releaseFiles(base: string): void {
  folders.delete(base);
}

/** Whether an address is that of held files, or of their folder. */
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
