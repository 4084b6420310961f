/**
 * Finds out whether the bundle is a view: an intermediate bundle of a source that the server is
 * building. Pure.
 */

/** Header of the manifest by which the server reports a build, with the folder of the newest view. */
const HEADER = "Stereocell-Live";

/** A build that can be watched: its websocket, and the folder of its newest view. */
export type LiveHost = Readonly<{ socket: string; folder: string }>;

/** Returns the build that the headers of a manifest name; null if there is none. */
export function liveHost(headers: Headers, base: string): LiveHost | null {
  const found = /^version=1; folder=((?:g\d+\/)?)$/.exec(headers.get(HEADER)?.trim() ?? "");
  if (found === null) return null;
  const url = new URL("live", base);
  url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
  return { socket: url.href, folder: found[1] };
}
