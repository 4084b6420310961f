import { BundleError } from "./errors";

/** Addresses that a document without a web host (a notebook's frame, or a scene in one file) gives to its page. */
type PageHost = Readonly<{
  /** Replaces the page's address in a notebook's frame, which has none. The view comes after its `#`. */
  page?: string;
  /** The bundle's folder, whose files the document itself contains; if absent, the bundle is beside `page`. */
  bundle?: string;
  /** The port to the notebook's widget. */
  port?: MessagePort;
}>;

declare global {
  var stereocellHost: PageHost | undefined;
}

/** Returns whether the page has an address that can contain a view. */
export function hasAddress(): boolean {
  return globalThis.stereocellHost?.page === undefined;
}

/** Returns the page's own address, or the one that a notebook gives it. */
export function pageAddress(): string {
  return globalThis.stereocellHost?.page ?? location.href;
}

/** Returns the address beside which the viewer's files are. A document that contains the bundle contains them, too. */
export function viewerAddress(): string {
  return globalThis.stereocellHost?.bundle ?? pageAddress();
}

/**
 * Returns the address of a source that the page has to read by itself; null if the page shows a bundle. `?source=` names
 * it, relative to the page or absolute. A document that contains its bundle reads no source.
 * Throws BundleError if it names no address of the web, or if the page is to show a bundle as well.
 */
export function sourceAddress(page: string): string | null {
  const asked = new URL(page).searchParams;
  const named = asked.get("source");
  if (globalThis.stereocellHost?.bundle !== undefined || !named) return null;
  if (asked.has("bundle")) {
    throw new BundleError(
      "?source= and ?bundle= are both given, expected one of them: remove the other",
    );
  }
  const url = URL.canParse(named, page) ? new URL(named, page) : null;
  if (url === null || !/^https?:$/.test(url.protocol)) {
    throw new BundleError(
      `?source= is "${named}", expected an image's address on the web, https://: open files and other ` +
        "places with stereocell view",
    );
  }
  url.hash = "";
  return url.href;
}

/** Returns whether the address names a bundle; a page without this name may still have a bundle beside it. */
export function namesBundle(page: string): boolean {
  return globalThis.stereocellHost !== undefined || new URL(page).searchParams.has("bundle");
}

/**
 * Returns the folder of the bundle, with a closing slash. `?bundle=` names the folder or its manifest.json, relative to
 * the page or absolute. Without it the bundle is beside the page. A document that contains its bundle opens no other.
 * Throws BundleError if it names no address of the web.
 */
export function bundleAddress(page: string): string {
  const brought = globalThis.stereocellHost?.bundle;
  if (brought !== undefined) return brought;
  const named = new URL(page).searchParams.get("bundle");
  if (named === null || named === "") return new URL("./", page).href.split(/[?#]/)[0];
  const url = URL.canParse(named, page) ? new URL(named, page) : null;
  if (url === null || !/^https?:$/.test(url.protocol)) {
    throw new BundleError(`?bundle= is "${named}", expected a folder's address on the web`);
  }
  if (url.pathname.endsWith("/manifest.json")) url.pathname = url.pathname.slice(0, -13);
  if (!url.pathname.endsWith("/")) url.pathname += "/";
  return url.href;
}
