/** Finds out whether a host sends the bricks that the camera's view needs. Pure. */

/**
 * Header by which the server reports on every response that it sends bricks. While a source is
 * built, it names the folder of the intermediate bundle to which the bricks belong.
 */
const HEADER = "Stereocell-Bricks";

/** Returns the websocket's address; null if the host has none. */
export function bricksAddress(headers: Headers, base: string): string | null {
  const found = /^version=1(?:; folder=(g\d+\/))?$/.exec(headers.get(HEADER)?.trim() ?? "");
  if (found === null) return null;
  const [, folder = ""] = found;
  const url = new URL(base.endsWith(`/${folder}`) ? "bricks" : `${folder}bricks`, base);
  url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
  return url.href;
}
