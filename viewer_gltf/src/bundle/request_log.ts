/** The requests to the bundle's host so far, for a service worker that starts later. */

/** `range`: the Range header. */
export type Asked = Readonly<{ url: string; range: string | null }>;

let log: Map<string, Asked> | null = new Map();

export function noteAsked(url: string, headers: HeadersInit | undefined): void {
  const range = new Headers(headers).get("Range");
  log?.set(`${url} ${range}`, { url, range });
}

/** All of it, once; nothing is noted from then on. */
export function takeAsked(): readonly Asked[] {
  const asked = [...(log?.values() ?? [])];
  log = null;
  return asked;
}
