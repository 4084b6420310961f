/** Fetch files of a bundle, from a host or from the page itself. Every fault becomes a BundleError that names the file. */
import { BundleError, MissingError, TemporaryError } from "./errors";
import type { FileRef } from "./generated/bundle";
import { checkHash } from "./hash";
import { heldResponse, isHeld } from "./held_files";
import { noteAsked } from "./request_log";
import { withRetries } from "./retry";

/** The address of a path that a manifest names; the bundle's query, if any, goes with it. */
export function fileAddress(base: string, path: string): string {
  const url = new URL(base);
  return new URL(path + url.search, base).href;
}

/** HTTP status of an answer to a range. */
const PART = 206;

/** Answers of a host that may be better a moment later. */
const BUSY = 429;
const FIRST_SERVER_FAULT = 500;

/**
 * The response of `url`, if its status says success, with all of its body here already. `path` is
 * the file's name in messages. Faults of the network and of the host, also in the middle of the
 * body, are tried again before they are thrown.
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

/** `fault`: of the host. One notice is enough for all files that it does not bring. */
function noticeOf(url: string, fault: string): string {
  return `The host ${new URL(url).host} ${fault}: not all files have come.`;
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
    const message = `${path}: the host answered ${status} for ${url}`;
    if (status !== BUSY && status < FIRST_SERVER_FAULT) throw new BundleError(message);
    throw new TemporaryError(message, { notice: noticeOf(url, `answers ${status}`) });
  }
  return response;
}

/** The response's bytes. Throws TemporaryError if the connection breaks before the last one. */
export async function readBody(response: Response, path: string): Promise<Uint8Array<ArrayBuffer>> {
  try {
    return new Uint8Array(await response.arrayBuffer());
  } catch (error) {
    if (error instanceof DOMException && error.name === "AbortError") throw error;
    const { url } = response; // "" for one that was made here
    throw new TemporaryError(`${path}: the connection broke before the file's end`, {
      cause: error,
      notice: url === "" ? undefined : noticeOf(url, "breaks the connection off"),
    });
  }
}

/** The file's bytes, after their number and hash were checked against the reference. */
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
 * A checked part of a file, or the whole file, checked, if the host sends no parts. What was spoilt
 * on its way may lie in a cache since: it is asked for once more, past all caches.
 *
 * @param name what the part is, in messages
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
    throw new BundleError(`${path}: expected ${file.bytes} bytes, found ${total}`);
  }
  if (bytes.length !== length) {
    throw new BundleError(`${path}: expected ${length} bytes of a range, found ${bytes.length}`);
  }
  try {
    await checkHash(`${path}: ${name}`, bytes, part.sha256);
  } catch (error) {
    if (cache === "reload" || !(error instanceof BundleError)) throw error;
    return fetchPart(base, file, part, name, signal, "reload");
  }
  return { bytes, isWhole: false };
}

/** Throws BundleError unless the bytes are the ones that the reference describes. */
export async function checkFile(file: FileRef, bytes: Uint8Array<ArrayBuffer>): Promise<void> {
  if (bytes.length !== file.bytes) {
    throw new BundleError(
      `${file.path}: expected ${file.bytes} bytes, found ${bytes.length} (a broken upload?)`,
    );
  }
  await checkHash(file.path, bytes, file.sha256);
}

/** The parsed text. Throws BundleError if it is no JSON, as a host's own error page, or cut short. */
export function parseJson(text: string, path: string): unknown {
  try {
    return JSON.parse(text);
  } catch (error) {
    if (!(error instanceof SyntaxError)) throw error;
    if (/^\s*[{[]/.test(text)) {
      throw new BundleError(`${path}: the JSON is broken or cut short (${error.message})`, {
        cause: error,
      });
    }
    const start = text.trim().slice(0, 40).replace(/\s+/g, " ");
    throw new BundleError(`${path}: expected JSON, found "${start}"`, { cause: error });
  }
}
