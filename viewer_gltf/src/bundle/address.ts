/**
 * The folder that holds the bundle, with a closing slash. `?bundle=` names the folder or its
 * manifest.json, relative to the page or absolute; without it the bundle lies beside the page.
 */
export function bundleAddress(page: string): string {
  const named = new URL(page).searchParams.get("bundle");
  if (named === null || named === "") return new URL("./", page).href.split(/[?#]/)[0];
  const url = new URL(named, page);
  if (url.pathname.endsWith("/manifest.json")) url.pathname = url.pathname.slice(0, -13);
  if (!url.pathname.endsWith("/")) url.pathname += "/";
  return url.href;
}
