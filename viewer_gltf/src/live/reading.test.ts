import { afterEach, expect, it, vi } from "vitest";
import { isReading, whileReading, wordsOfReading } from "./reading";

afterEach(() => vi.unstubAllGlobals());

it.each([
  [0, "Reading the source: 0 %"],
  [0.259, "Reading the source: 25 %"],
  [1, "Opening the first view"],
])("a share of %d is shown as %s", (share, words) => {
  expect(wordsOfReading(share)).toBe(words);
});

it("progress in reading a source is reported while the job runs, and not afterwards", async () => {
  const fetched = vi.fn(async (_: URL) => ({ json: async () => ({ share: 0.5 }) }));
  vi.stubGlobal("fetch", fetched);
  const texts: string[] = [];
  let finish: (result: string) => void = () => undefined;
  const job = new Promise<string>((resolve) => {
    finish = resolve;
  });
  const result = whileReading("http://localhost/x/", job, (words) => texts.push(words));
  await expect.poll(() => texts).toEqual(["Reading the source: 50 %"]);
  finish("manifest");
  expect(await result).toBe("manifest");
  expect(fetched.mock.calls[0][0].href).toBe("http://localhost/reading");
  await new Promise((resolve) => setTimeout(resolve, 700));
  expect(texts.length).toBe(1);
});

it("a fault of the job is passed on, even if the server does not report progress", async () => {
  vi.stubGlobal("fetch", async () => {
    throw new TypeError("no network");
  });
  const job = Promise.reject(new Error("gone"));
  await expect(whileReading("http://localhost/", job, () => undefined)).rejects.toThrow("gone");
});

it("a source is known to be read if the server has announced it in the timing of the page", () => {
  const timing = (names: readonly string[]) =>
    vi.stubGlobal("performance", {
      getEntriesByType: () => [{ serverTiming: names.map((name) => ({ name })) }],
    });
  timing(["stereocell-reading"]);
  expect(isReading()).toBe(true);
  timing(["cdn"]);
  expect(isReading()).toBe(false);
  vi.stubGlobal("performance", { getEntriesByType: () => [] });
  expect(isReading()).toBe(false);
});
