/** One zstd decoder for the page: its WebAssembly comes inside the script. */
import { ZSTDDecoder } from "zstddec";
import { BundleError } from "../bundle/errors";

const decoder = new ZSTDDecoder();
let ready: Promise<void> | undefined;

/** The decompressed bytes, `size` of them. Throws BundleError naming `path` if that fails. */
export async function unzstd(
  bytes: Uint8Array,
  size: number,
  path: string,
): Promise<Uint8Array<ArrayBuffer>> {
  ready ??= decoder.init();
  await ready;
  let decoded: Uint8Array<ArrayBuffer>;
  try {
    decoded = decoder.decode(bytes, size) as Uint8Array<ArrayBuffer>; // a copy of its own
  } catch (error) {
    throw new BundleError(`${path}: the zstd stream is broken`, { cause: error });
  }
  if (decoded.length !== size) {
    throw new BundleError(`${path}: expected ${size} texel bytes, found ${decoded.length}`);
  }
  return decoded;
}
