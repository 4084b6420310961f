import { describe, expect, it } from "vitest";
import { fromText, keysToDrop, toText, totalBytes } from "./ledger";

const LEDGER = new Map([
  ["new", { bytes: 30, used_ms: 3 }],
  ["old", { bytes: 10, used_ms: 1 }],
  ["middle", { bytes: 20, used_ms: 2 }],
]);

describe("the offline store's ledger", () => {
  it("drops the least recently used entries, and only as many as necessary", () => {
    expect(totalBytes(LEDGER)).toBe(60);
    expect(keysToDrop(LEDGER, 60)).toEqual([]);
    expect(keysToDrop(LEDGER, 55)).toEqual(["old"]);
    expect(keysToDrop(LEDGER, 50)).toEqual(["old"]);
    expect(keysToDrop(LEDGER, 49)).toEqual(["old", "middle"]);
    expect(keysToDrop(LEDGER, 0)).toEqual(["old", "middle", "new"]);
  });

  it("is the same after writing and reading", () => {
    expect(fromText(toText(LEDGER))).toEqual(LEDGER);
  });

  it("is empty if its text is broken", () => {
    for (const text of ["", "[1", "{}", "[1]"]) expect(fromText(text).size).toBe(0);
  });
});
