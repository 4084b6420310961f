import { describe, expect, it } from "vitest";
import { BundleError, TemporaryError } from "./errors";
import { withRetries } from "./retry";

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

  it("fails at once where another try can't help", async () => {
    const job = failing(1, new BundleError("not found"));
    await expect(withRetries(job, null, [0, 0])).rejects.toThrow("not found");
  });

  it("stops when it is no longer wanted", async () => {
    const job = failing(1, new TemporaryError("busy"));
    await expect(withRetries(job, AbortSignal.abort(), [0])).rejects.toThrow(/abort/i);
  });
});
