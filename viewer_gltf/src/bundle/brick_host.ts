/** Whether a host sends bricks by view. Pure. */

/** The server's word for it, on every answer; with the folder of a view that has bricks of its own. */
const HEADER = "Stereocell-Bricks";

/** The websocket's address; null: the host has none. */
export function bricksAddress(headers: Headers, base: string): string | null {
  const found = /^version=1(?:; folder=(g\d+\/))?$/.exec(headers.get(HEADER)?.trim() ?? "");
  if (found === null) return null;
  const [, folder = ""] = found;
  const url = new URL(base.endsWith(`/${folder}`) ? "bricks" : `${folder}bricks`, base);
  url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
  return url.href;
}
