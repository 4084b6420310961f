/** Hold bytes against the hash that a bundle gives of them. */
import { BundleError } from "./errors";

/** How a hash is written down. */
export type HashForm = Readonly<{ name: string; write: (digest: Uint8Array) => string }>;

/** As the manifest and the lists of volumes have it: lower-case hexadecimal. */
const SHA_256: HashForm = {
  name: "SHA-256",
  write: (digest) => Array.from(digest, (byte) => byte.toString(16).padStart(2, "0")).join(""),
};

/** As tilesets have it, under this name: its first 128 bits in base64url (RFC 6920). */
export const SHA_256_128: HashForm = {
  name: "sha-256-128",
  write: (digest) =>
    btoa(String.fromCharCode(...digest.subarray(0, 16)))
      .replaceAll("+", "-")
      .replaceAll("/", "_")
      .replaceAll("=", ""),
};

/**
 * Throws BundleError, which begins with `what`, unless the bytes have this hash. That takes a secure
 * context (https or localhost); elsewhere the size, which callers check first, has to do.
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
