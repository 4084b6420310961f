import { describe, expect, it } from "vitest";
import { BundleError, TemporaryError } from "./errors";
import { watchWaiting, withRetries } from "./retry";

describe("a job that may be tried again", () => {
  const failing = (times: number, error: Error) => {
    let tries = 0;
    return async () => {
      tries++;
      if (tries <= times) throw error;
      return tries;
    };
  };

  it("succeeds after temporary faults", async () => {
    const job = failing(2, new TemporaryError("busy"));
    expect(await withRetries(job, null, [0, 0])).toBe(3);
  });

  it("fails once the pauses are used up", async () => {
    const job = failing(3, new TemporaryError("busy"));
    await expect(withRetries(job, null, [0, 0])).rejects.toThrow("busy");
  });

  it("fails at once if another try can't help", async () => {
    const job = failing(1, new BundleError("not found"));
    await expect(withRetries(job, null, [0, 0])).rejects.toThrow("not found");
  });

  it("is reported as waiting, and the end of waiting is reported once no job waits", async () => {
    const reported: number[] = [];
    watchWaiting((jobs) => reported.push(jobs));
    const jobs = [1, 2, 3].map((n) => failing(n, new TemporaryError("busy")));
    await Promise.all(jobs.map((job) => withRetries(job, null, [5, 5, 5])));
    expect(reported).toEqual([1, 2, 3, 0]);
    await expect(withRetries(failing(9, new TemporaryError("busy")), null, [0])).rejects.toThrow();
    expect(reported).toEqual([1, 2, 3, 0, 1, 0]);
    await withRetries(async () => 1, null, [0]);
    expect(reported).toHaveLength(6);
  });

  it("stops at once if it is aborted during a pause", async () => {
    const stop = new AbortController();
    const waiting = withRetries(failing(1, new TemporaryError("busy")), stop.signal, [60_000]);
    setTimeout(() => stop.abort(), 5);
    await expect(waiting).rejects.toThrow(/abort/i);
  });

  it("stops if it is aborted", async () => {
    const job = failing(1, new TemporaryError("busy"));
    await expect(withRetries(job, AbortSignal.abort(), [0])).rejects.toThrow(/abort/i);
  });
});
