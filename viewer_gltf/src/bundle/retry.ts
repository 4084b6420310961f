/** Try again what may succeed a moment later, and report meanwhile that the network is awaited. */
import { TemporaryError } from "./errors";

/** Pauses before the second, third and fourth try, ms. */
const PAUSES_MS: readonly number[] = [300, 1200, 4000];
/** Longest wait for a network at each pause, ms, on a device that knows that it has none. */
const OFFLINE_MS = 30_000;

/** Called with the number of jobs that wait for another try: when one more begins to wait, and when none does. */
export type WaitListener = (jobs: number) => void;

let listener: WaitListener = () => undefined;
let waiting = 0;

export function watchWaiting(onWaiting: WaitListener): void {
  listener = onWaiting;
}

function count(change: 1 | -1): void {
  waiting += change;
  if (change === 1 || waiting === 0) listener(waiting);
}

/** Reports that a connection is awaited besides, or no longer. */
export function noteWait(isWaiting: boolean): void {
  count(isWaiting ? 1 : -1);
}

/** The pause, or less where the network comes back or the job is no longer wanted. */
function rest(pause_ms: number, signal: AbortSignal | null | undefined): Promise<void> {
  const isOffline = globalThis.navigator?.onLine === false;
  return new Promise((resolve) => {
    const over = () => {
      clearTimeout(timer);
      globalThis.removeEventListener?.("online", over);
      signal?.removeEventListener("abort", over);
      resolve();
    };
    const timer = setTimeout(over, isOffline ? OFFLINE_MS : pause_ms);
    globalThis.addEventListener?.("online", over);
    signal?.addEventListener("abort", over);
  });
}

/** The job's result. A TemporaryError is thrown only once the pauses are used up. */
export async function withRetries<T>(
  job: () => Promise<T>,
  signal?: AbortSignal | null,
  pauses_ms = PAUSES_MS,
): Promise<T> {
  let isWaiting = false;
  try {
    for (const pause_ms of pauses_ms) {
      try {
        return await job();
      } catch (error) {
        if (!(error instanceof TemporaryError)) throw error;
      }
      if (!isWaiting) count(1);
      isWaiting = true;
      signal?.throwIfAborted();
      await rest(pause_ms, signal);
      signal?.throwIfAborted();
    }
    return await job();
  } finally {
    if (isWaiting) count(-1);
  }
}
