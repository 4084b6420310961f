/** Repeats jobs after temporary faults, and reports while a job waits for its next try. */
import { TemporaryError } from "./errors";

/** Pauses before the second, third and fourth try of a job, ms. */
const PAUSES_MS: readonly number[] = [300, 1200, 4000];
/** Longest pause, ms, while the browser reports that the device is offline. */
const OFFLINE_MS = 30_000;

/** Called with the number of waiting jobs, whenever a job begins to wait and when no job waits any more. */
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

/** Counts a connection that waits for its next try outside of `withRetries`, or has stopped waiting. */
export function noteWait(isWaiting: boolean): void {
  count(isWaiting ? 1 : -1);
}

/** Waits for a pause; less if the network comes back or the job is aborted. */
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

/** Returns the job's result, and repeats the job after a TemporaryError. Throws the error of the last try. */
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
