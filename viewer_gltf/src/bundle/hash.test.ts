import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { BundleError } from "./errors";
import { checkHash, SHA_256_128 } from "./hash";

const ABC = new TextEncoder().encode("abc");
/** FIPS 180-4's own example. */
const HASH = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
const SHORT = "ungWv48Bz-pBQUDeXa4iIw";

describe("a hash", () => {
  beforeEach(() => void vi.stubGlobal("isSecureContext", true));
  afterEach(() => vi.unstubAllGlobals());

  it("of the right bytes passes, in either form", async () => {
    await checkHash("a.glb", ABC, HASH);
    await checkHash("a.glb", ABC, SHORT, SHA_256_128);
  });

  it("of other bytes is reported with the expected and the found one", async () => {
    const other = HASH.replace("b", "c");
    const wrong = checkHash("a.ktx2: level 2", ABC, other);
    await expect(wrong).rejects.toThrow(
      new BundleError(`a.ktx2: level 2: expected SHA-256 ${other}, found ${HASH}`),
    );
    await expect(checkHash("a.glb", ABC, "AAAA", SHA_256_128)).rejects.toThrow(
      `a.glb: expected sha-256-128 AAAA, found ${SHORT}`,
    );
  });

  it("can't be had outside a secure context", async () => {
    vi.stubGlobal("isSecureContext", false);
    await checkHash("a.glb", ABC, "another");
  });
});
