/** Fetches files of a bundle from a host or from the page itself. Each fault is a BundleError that names the file. */
import { BundleError, MissingError, TemporaryError } from "./errors";
import type { FileRef } from "./generated/bundle";
import { checkHash } from "./hash";
import { heldResponse, isHeld } from "./held_files";
import { noteAsked } from "./request_log";
import { withRetries } from "./retry";

/** Returns the address of a path in a manifest, including the query of the bundle's address, if any. */
export function fileAddress(base: string, path: string): string {
  const url = new URL(base);
  return new URL(path + url.search, base).href;
}

/** HTTP status of a response with a part of a file. */
const PART = 206;

/** HTTP statuses of faults that may pass: this one, and all from the next one up. */
const BUSY = 429;
const FIRST_SERVER_FAULT = 500;

/**
 * Returns the response of `url` after its whole body has arrived. `path` is the file's name in messages. After a
 * temporary fault of the network or the host, also within the body, the request is repeated; the last fault is thrown.
 */
export function request(url: string, path: string, options: RequestInit = {}): Promise<Response> {
  noteAsked(url, options.headers);
  const whole = async () => {
    const response = await requestOnce(url, path, options);
    const status = response.status === PART ? PART : 200;
    const body = await readBody(response, path);
    noteAsked(url, options.headers, true);
    return new Response(body, { status, headers: response.headers });
  };
  return withRetries(whole, options.signal);
}

/** Returns the notice for a host's fault; it names no file, so that one notice serves for all missing files. */
function noticeOf(url: string, fault: string): string {
  return `The host ${new URL(url).host} ${fault}: some files are missing.`;
}

async function requestOnce(url: string, path: string, options: RequestInit): Promise<Response> {
  let response: Response;
  try {
    response = isHeld(url) ? heldResponse(url) : await fetch(url, options);
  } catch (error) {
    if (error instanceof DOMException && error.name === "AbortError") throw error;
    const fault = "can't be reached, or forbids this page";
    throw new TemporaryError(`${path}: the host of ${url} ${fault}`, {
      cause: error,
      notice: noticeOf(url, fault),
    });
  }
  if (response.status === 404) throw new MissingError(`${path}: not found (404) at ${url}`);
  if (!response.ok) {
    const { status } = response;
    const message = `${path}: the host answered with status ${status} for ${url}`;
    if (status !== BUSY && status < FIRST_SERVER_FAULT) throw new BundleError(message);
    throw new TemporaryError(message, { notice: noticeOf(url, `answers with status ${status}`) });
  }
  return response;
}

/** Returns the response's bytes. Throws TemporaryError if the connection breaks before the last one. */
export async function readBody(response: Response, path: string): Promise<Uint8Array<ArrayBuffer>> {
  try {
    return new Uint8Array(await response.arrayBuffer());
  } catch (error) {
    if (error instanceof DOMException && error.name === "AbortError") throw error;
    const { url } = response; // "" for a response that the page itself has made
    throw new TemporaryError(`${path}: the connection broke before the file's end`, {
      cause: error,
      notice: url === "" ? undefined : noticeOf(url, "closes the connection too early"),
    });
  }
}

/** Returns the file's bytes after it has checked their number and hash. Throws BundleError. */
export async function fetchFile(
  base: string,
  file: FileRef,
  signal?: AbortSignal,
): Promise<Uint8Array<ArrayBuffer>> {
  const response = await request(fileAddress(base, file.path), file.path, { signal });
  const bytes = await readBody(response, file.path);
  await checkFile(file, bytes);
  return bytes;
}

/** Bytes of a file, from `offset` on. */
export type FilePart = Readonly<{ offset: number; length: number; sha256: string }>;

/**
 * Returns a checked part of a file, or the whole checked file if the host does not send parts. A part with a wrong hash
 * is requested a second time without caches, since a cache may contain a damaged copy.
 *
 * @param name the part's name in messages
 */
export async function fetchPart(
  base: string,
  file: FileRef,
  part: FilePart,
  name: string,
  signal?: AbortSignal,
  cache: RequestCache = "default",
): Promise<{ bytes: Uint8Array<ArrayBuffer>; isWhole: boolean }> {
  const { path } = file;
  const { offset, length } = part;
  const headers = { Range: `bytes=${offset}-${offset + length - 1}` };
  const response = await request(fileAddress(base, path), path, { signal, cache, headers });
  const bytes = await readBody(response, path);
  if (response.status !== PART) {
    await checkFile(file, bytes);
    return { bytes, isWhole: true };
  }
  const total = response.headers.get("Content-Range")?.split("/")[1];
  if (total !== undefined && total !== "*" && Number(total) !== file.bytes) {
    throw new BundleError(`${path}: found ${total} bytes, expected ${file.bytes}`);
  }
  if (bytes.length !== length) {
    throw new BundleError(`${path}: found ${bytes.length} bytes of a range, expected ${length}`);
  }
  try {
    await checkHash(`${path}: ${name}`, bytes, part.sha256);
  } catch (error) {
    if (cache === "reload" || !(error instanceof BundleError)) throw error;
    return fetchPart(base, file, part, name, signal, "reload");
  }
  return { bytes, isWhole: false };
}

/** Throws BundleError unless number and hash of the bytes agree with the reference. */
export async function checkFile(file: FileRef, bytes: Uint8Array<ArrayBuffer>): Promise<void> {
  if (bytes.length !== file.bytes) {
    throw new BundleError(
      `${file.path}: found ${bytes.length} bytes, expected ${file.bytes}: upload the file again`,
    );
  }
  await checkHash(file.path, bytes, file.sha256);
}

/** Returns the parsed text. Throws BundleError if it is not JSON (perhaps a host's error page), or is cut short. */
export function parseJson(text: string, path: string): unknown {
  try {
    return JSON.parse(text);
  } catch (error) {
    if (!(error instanceof SyntaxError)) throw error;
    if (/^\s*[{[]/.test(text)) {
      throw new BundleError(
        `${path}: found damaged or incomplete JSON (${error.message}): upload the file again`,
        {
          cause: error,
        },
      );
    }
    const start = text.trim().slice(0, 40).replace(/\s+/g, " ");
    throw new BundleError(`${path}: found "${start}", expected JSON`, { cause: error });
  }
}
