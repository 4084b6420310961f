import { describe, expect, it } from "vitest";
import { LoadQueue } from "./load_queue";

describe("the queue of loads", () => {
  it("starts the cheapest waiting job, up to its limit at a time", async () => {
    const queue = new LoadQueue(1);
    const { signal } = new AbortController();
    const order: number[] = [];
    const job = (cost: number) => queue.add(cost, signal, async () => void order.push(cost));
    await Promise.all([job(5), job(9), job(1), job(3)]);
    expect(order).toEqual([5, 1, 3, 9]); // 5 found the queue empty
  });

  it("goes on after a failure, and drops aborted jobs", async () => {
    const queue = new LoadQueue(1);
    const controller = new AbortController();
    const failing = queue.add(1, controller.signal, () => Promise.reject(new Error("no")));
    const dropped = queue.add(2, controller.signal, async () => "never");
    const kept = queue.add(3, new AbortController().signal, async () => "kept");
    controller.abort();
    await expect(failing).rejects.toThrow("no");
    await expect(dropped).rejects.toMatchObject({ name: "AbortError" });
    await expect(kept).resolves.toBe("kept");
  });
});
