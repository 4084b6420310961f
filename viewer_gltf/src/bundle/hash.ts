/** Compares bytes with their hash in a bundle. */
import { BundleError } from "./errors";

/** How a hash is written down. */
export type HashForm = Readonly<{ name: string; write: (digest: Uint8Array) => string }>;

/** The form in the manifest and the lists of volumes: lower-case hexadecimal. */
const SHA_256: HashForm = {
  name: "SHA-256",
  write: (digest) => Array.from(digest, (byte) => byte.toString(16).padStart(2, "0")).join(""),
};

/** The form in tilesets, with its name there: the first 128 bits in base64url (RFC 6920). */
export const SHA_256_128: HashForm = {
  name: "sha-256-128",
  write: (digest) =>
    btoa(String.fromCharCode(...digest.subarray(0, 16)))
      .replaceAll("+", "-")
      .replaceAll("/", "_")
      .replaceAll("=", ""),
};

/**
 * Throws BundleError, whose message begins with `what`, unless the bytes have this hash. Outside a secure context
 * (https or localhost) it checks nothing; callers check the size first.
 */
export async function checkHash(
  what: string,
  bytes: Uint8Array<ArrayBuffer>,
  expected: string,
  form = SHA_256,
): Promise<void> {
  if (!globalThis.isSecureContext) return;
  const found = form.write(new Uint8Array(await crypto.subtle.digest("SHA-256", bytes)));
  if (found !== expected) {
    throw new BundleError(`${what}: expected ${form.name} ${expected}, found ${found}`);
  }
}
