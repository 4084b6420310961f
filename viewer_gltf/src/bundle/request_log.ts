/** Logs the requests to the bundle's host, for a service worker that keeps files which were loaded before it started. */

/** A request; `range` is its Range header. */
export type Asked = Readonly<{ url: string; range: string | null }>;

/** Requests by address and range, and whether each has been answered. */
const log = new Map<string, Readonly<{ asked: Asked; hasAnswer: boolean }>>();

export const keyOf = ({ url, range }: Asked) => `${url} ${range}`;

export function noteAsked(url: string, headers: HeadersInit | undefined, hasAnswer = false): void {
  const asked = { url, range: new Headers(headers).get("Range") };
  const before = log.get(keyOf(asked));
  log.set(keyOf(asked), { asked, hasAnswer: hasAnswer || before?.hasAnswer === true });
}

export function allAsked(): readonly Asked[] {
  return [...log.values()].map(({ asked }) => asked);
}

/** Returns the requests that the host has answered. */
export function allAnswered(): readonly Asked[] {
  return [...log.values()].filter(({ hasAnswer }) => hasAnswer).map(({ asked }) => asked);
}
