/** Try again what may succeed a moment later. */
import { TemporaryError } from "./errors";

/** Before the second and third try. */
export const PAUSES_MS: readonly number[] = [300, 1200];

/** The job's result. A TemporaryError is thrown only once the pauses are used up. */
export async function withRetries<T>(
  job: () => Promise<T>,
  signal?: AbortSignal | null,
  pauses_ms = PAUSES_MS,
): Promise<T> {
  for (const pause_ms of pauses_ms) {
    try {
      return await job();
    } catch (error) {
      if (!(error instanceof TemporaryError)) throw error;
    }
    await new Promise((resolve) => setTimeout(resolve, pause_ms));
    signal?.throwIfAborted();
  }
  return job();
}
