/** Whether a source is being built behind the bundle, which is a view of it. Pure. */

/** The server's word for it, with the folder of the newest view, on the manifest. */
const HEADER = "Stereocell-Live";

/** A build that can be watched: its websocket, and the folder of its newest view. */
export type LiveHost = Readonly<{ socket: string; folder: string }>;

/** Returns what the answer to a manifest says of a build behind it; null: there is none. */
export function liveHost(headers: Headers, base: string): LiveHost | null {
  const found = /^version=1; folder=((?:g\d+\/)?)$/.exec(headers.get(HEADER)?.trim() ?? "");
  if (found === null) return null;
  const url = new URL("live", base);
  url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
  return { socket: url.href, folder: found[1] };
}
