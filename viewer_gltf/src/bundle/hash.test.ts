import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { BundleError } from "./errors";
import { checkHash, SHA_256_128 } from "./hash";

const ABC = new TextEncoder().encode("abc");
/** SHA-256 of "abc", the example of FIPS 180-4. */
const HASH = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
const SHORT = "ungWv48Bz-pBQUDeXa4iIw";

describe("a hash", () => {
  beforeEach(() => void vi.stubGlobal("isSecureContext", true));
  afterEach(() => vi.unstubAllGlobals());

  it("passes for the right bytes, in both forms", async () => {
    await checkHash("a.glb", ABC, HASH);
    await checkHash("a.glb", ABC, SHORT, SHA_256_128);
  });

  it("is reported with the expected and the found one if the bytes differ", async () => {
    const other = HASH.replace("b", "c");
    const wrong = checkHash("a.ktx2: level 2", ABC, other);
    await expect(wrong).rejects.toThrow(
      new BundleError(`a.ktx2: level 2: expected SHA-256 ${other}, found ${HASH}`),
    );
    await expect(checkHash("a.glb", ABC, "AAAA", SHA_256_128)).rejects.toThrow(
      `a.glb: expected sha-256-128 AAAA, found ${SHORT}`,
    );
  });

  it("can't be computed outside a secure context", async () => {
    vi.stubGlobal("isSecureContext", false);
    await checkHash("a.glb", ABC, "another");
  });
});
