import { describe, expect, it } from "vitest";
import { BundleError } from "./errors";
import { fetchFile, fetchPart } from "./fetch";
import { holdFiles, isHeld } from "./held_files";

const bytes = Uint8Array.from([1, 2, 3, 4]);
const SHA_256 = "9f64a747e1b97f131fabb6b447296c9b6f0201e79fb3c5356e6c77e89b6a806a";

describe("files that the page holds", () => {
  const base = holdFiles(new Map([["channels/a/x.bin", bytes]]));
  const file = { path: "channels/a/x.bin", bytes: 4, sha256: SHA_256 };

  it("are read like those of a host", async () => {
    expect(isHeld(base)).toBe(true);
    expect(isHeld("https://host/")).toBe(false);
    expect(await fetchFile(base, file)).toEqual(bytes);
  });

  it("are returned whole if a part is requested", async () => {
    const part = { offset: 0, length: 2, sha256: "" };
    expect(await fetchPart(base, file, part, "level 0")).toEqual({ bytes, isWhole: true });
  });

  it("are separate for each set of files", async () => {
    const other = holdFiles(new Map());
    expect(other).not.toBe(base);
    await expect(fetchFile(other, file)).rejects.toThrow(BundleError);
    await expect(fetchFile(other, file)).rejects.toThrow("not found (404)");
  });
});
