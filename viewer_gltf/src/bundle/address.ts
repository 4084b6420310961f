import { BundleError } from "./errors";

/** What a notebook gives to the page that it holds in a frame, which has no address of its own. */
export type NotebookHost = Readonly<{
  /** Stands for the page's address: the bundle lies beside it, and the view is behind its `#`. */
  page: string;
  /** To the widget. */
  port: MessagePort;
}>;

declare global {
  var stereocellHost: NotebookHost | undefined;
}

/** The page's own address, or the one that a notebook gives it. */
export function pageAddress(): string {
  return globalThis.stereocellHost?.page ?? location.href;
}

/**
 * The folder that holds the bundle, with a closing slash. `?bundle=` names the folder or its
 * manifest.json, relative to the page or absolute; without it the bundle lies beside the page.
 * Throws BundleError if it names no address of the web.
 */
export function bundleAddress(page: string): string {
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
