import { BundleError } from "./errors";

/** A document without a web host (a notebook's frame, or a scene in one file) gives these to the page in it. */
type PageHost = Readonly<{
  /** Replaces the page's address in a notebook's frame, which has none. The view stands behind its `#`. */
  page?: string;
  /** The bundle's folder, which the document itself answers for; absent: the bundle lies beside `page`. */
  bundle?: string;
  /** The port to the notebook's widget. */
  port?: MessagePort;
}>;

declare global {
  var stereocellHost: PageHost | undefined;
}

/** Whether the page has an address in which a view can be kept. */
export function hasAddress(): boolean {
  return globalThis.stereocellHost?.page === undefined;
}

/** The page's own address, or the one that a notebook gives it. */
export function pageAddress(): string {
  return globalThis.stereocellHost?.page ?? location.href;
}

/** The address beside which the viewer's own files lie. A document that brings the bundle along brings those, too. */
export function viewerAddress(): string {
  return globalThis.stereocellHost?.bundle ?? pageAddress();
}

/**
 * The folder that holds the bundle, with a closing slash. `?bundle=` names the folder or its
 * manifest.json, relative to the page or absolute; without it the bundle lies beside the page. A document that
 * brings its bundle along opens no other.
 * Throws BundleError if it names no address of the web.
 */
export function bundleAddress(page: string): string {
  const brought = globalThis.stereocellHost?.bundle;
  if (brought !== undefined) return brought;
  const named = new URL(page).searchParams.get("bundle");
  if (named === null || named === "") return new URL("./", page).href.split(/[?#]/)[0];
  const url = URL.canParse(named, page) ? new URL(named, page) : null;
  if (url === null || !/^https?:$/.test(url.protocol)) {
    throw new BundleError(`?bundle=: expected a folder's address on the web, found "${named}"`);
  }
  if (url.pathname.endsWith("/manifest.json")) url.pathname = url.pathname.slice(0, -13);
  if (!url.pathname.endsWith("/")) url.pathname += "/";
  return url.href;
}
