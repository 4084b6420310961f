import { expect, it } from "vitest";
import { summarise } from "./frame_times";

it("the summary has the median, the 95th percentile and the longest time between frames", () => {
  // There are 19 steps of 10 ms, and one of 110 ms.
  const times = Array.from({ length: 20 }, (_, i) => 10 * i);
  const found = summarise([...times, 300]);
  expect(found).toEqual({ frames: 20, median_ms: 10, p95_ms: 15, longest_ms: 110, fps: 100 });
});

it("the summary is null for a single frame", () => {
  expect(summarise([])).toBeNull();
  expect(summarise([5])).toBeNull();
});
