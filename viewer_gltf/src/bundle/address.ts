import { BundleError } from "./errors";

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
