/** Whether a host sends bricks by view. Pure. */

/** The server's word for it, on every answer. */
const HEADER = "Stereocell-Bricks";

/** The websocket's address; null: the host has none. */
export function bricksAddress(headers: Headers, base: string): string | null {
  if (headers.get(HEADER)?.trim() !== "version=1") return null;
  const url = new URL("bricks", base);
  url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
  return url.href;
}
