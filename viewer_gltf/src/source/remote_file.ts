/**
 * Reads files of a source from a host. A page may read another host's files only if that host allows it. Each error
 * names the person who can solve it: the user, or the operator of the host.
 *
 * Requests carry no cookie and no Referer. Parts are requested by their first and last byte, which needs no CORS
 * preflight; a request for the last bytes of a file would need one.
 */
import { TemporaryError } from "../bundle/errors";
import { withRetries } from "../bundle/retry";
import { type ByteRange, type ByteSource, type FileStore, placeOf } from "./byte_source";
import { SourceError } from "./source_error";

const OPTIONS: RequestInit = { credentials: "omit", referrerPolicy: "no-referrer" };
/** HTTP status of a response with a part of a file. */
const PART = 206;
/** HTTP statuses for a missing file. Buckets that do not allow listing answer 403. */
const NO_FILE = [403, 404];
/** HTTP statuses of faults that may pass: this one, and all from the next one up. */
const BUSY = 429;
const FIRST_SERVER_FAULT = 500;

/** The host does not let this page read a response, which may also be the response for a missing file. */
class RefusedError extends SourceError {}

/** Returns the response; null if there is no such file. Throws SourceError, or TemporaryError after some retries. */
async function ask(url: URL, options: RequestInit = {}): Promise<Response | null> {
  return withRetries(async () => {
    let response: Response;
    try {
      response = await fetch(url, { ...OPTIONS, ...options });
    } catch (error) {
      throw await refusalOf(url, error);
    }
    const { status, ok } = response;
    if (NO_FILE.includes(status)) return null;
    if (ok) return response;
    const message = `The host ${url.host} answers with status ${status} for ${url.pathname}`;
    if (status === BUSY || status >= FIRST_SERVER_FAULT) {
      throw new TemporaryError(`${message}. Try again later, or ask the operator of the host.`);
    }
    throw new SourceError(`${message}. Check the address, or ask the operator of the host.`);
  });
}

/** Returns the reason why the page can't read an address, and the remedy. */
async function refusalOf(url: URL, cause: unknown): Promise<SourceError> {
  const { host } = url;
  const isLocal = /^(localhost|127\.0\.0\.1|\[::1\])$/.test(url.hostname);
  if (globalThis.location?.protocol === "https:" && url.protocol === "http:" && !isLocal) {
    return new SourceError(
      `This page was loaded over https and can't read files over http. Ask the operator of ${host} to offer https.`,
      { cause },
    );
  }
  try {
    await fetch(url, { ...OPTIONS, mode: "no-cors" });
  } catch {
    const text = `The host ${host} can't be reached. Check the address and the network.`;
    return new SourceError(text, { cause });
  }
  const origin = globalThis.location?.origin ?? "*";
  return new RefusedError(
    `The host ${host} does not let other pages read its files. Ask the operator of the host to answer with the CORS header ` +
      `Access-Control-Allow-Origin: ${origin} (or *).`,
    { cause },
  );
}

async function bodyOf(response: Response, url: URL): Promise<Uint8Array<ArrayBuffer>> {
  try {
    return new Uint8Array(await response.arrayBuffer());
  } catch (error) {
    throw new SourceError(
      `The connection to ${url.host} broke while reading ${url.pathname}. Try again.`,
      { cause: error },
    );
  }
}

/** Returns a part of the file at an address; null if there is no such file. */
async function partOf(
  url: URL,
  { offset, length }: Readonly<{ offset: number; length: number }>,
): Promise<Uint8Array<ArrayBuffer> | null> {
  if (length === 0) return new Uint8Array(0);
  const response = await ask(url, { headers: { Range: `bytes=${offset}-${offset + length - 1}` } });
  if (response === null) return null;
  if (response.status !== PART) {
    await response.body?.cancel();
    throw new SourceError(
      `The host ${url.host} does not send parts of files, which a zip file or a sharded image needs. Ask the operator of the host ` +
        "to turn on HTTP range requests, or to offer the image unpacked and without shards.",
    );
  }
  const bytes = await bodyOf(response, url);
  if (bytes.length === length) return bytes;
  throw new SourceError(
    `${url.pathname}: found ${bytes.length} bytes from ${offset} on, expected ${length}: ask the operator of the host to ` +
      "upload the file again.",
  );
}

/** Returns the size of the file at an address; null if there is no such file. */
async function sizeOf(url: URL): Promise<number | null> {
  const response = await ask(url, { method: "HEAD" });
  if (response === null) return null;
  const size = Number(response.headers.get("Content-Length") ?? Number.NaN);
  if (Number.isFinite(size)) return size;
  throw new SourceError(
    `The host ${url.host} states no Content-Length for ${url.pathname}. Ask the operator of the host to let pages read that header.`,
  );
}

function missing(url: URL): SourceError {
  return new SourceError(
    `${url.href} was not found. Check the address, or ask the operator of ${url.host} whether the file is public.`,
  );
}

/** One file at an address. */
export class RemoteFile implements ByteSource {
  private found: Promise<number> | null = null;

  constructor(private readonly url: URL) {}

  get name(): string {
    return decodeURIComponent(this.url.pathname.split("/").pop() ?? "");
  }

  size(): Promise<number> {
    this.found ??= sizeOf(this.url).then((size) => {
      if (size === null) throw missing(this.url);
      return size;
    });
    return this.found;
  }

  async read(offset: number, length: number): Promise<Uint8Array<ArrayBuffer>> {
    const bytes = await partOf(this.url, { offset, length });
    if (bytes === null) throw missing(this.url);
    return bytes;
  }

  async stream(): Promise<ReadableStream<Uint8Array<ArrayBuffer>>> {
    const response = await ask(this.url);
    if (response?.body == null) throw missing(this.url);
    return response.body;
  }
}

/**
 * The files below a folder's address. The address's query, such as a token, is part of each request.
 *
 * Many hosts let pages read their files, but not the response for a missing file. A refusal thus counts as a missing
 * file. Only if no file could be read at all is the refusal reported.
 */
export class RemoteFolder implements FileStore {
  refusal: SourceError | null = null;
  private hasRead = false;
  private readonly sizes = new Map<string, Promise<number | null>>();

  constructor(private readonly root: URL) {}

  async get(key: string): Promise<Uint8Array<ArrayBuffer> | undefined> {
    const url = this.at(key);
    return this.noted(async () => {
      const response = await ask(url);
      return response === null ? null : bodyOf(response, url);
    });
  }

  async getRange(key: string, range: ByteRange): Promise<Uint8Array<ArrayBuffer> | undefined> {
    const url = this.at(key);
    if ("offset" in range) return this.noted(() => partOf(url, range));
    const size = this.sizes.get(key) ?? sizeOf(url);
    this.sizes.set(key, size);
    return this.noted(async () => {
      const found = await size;
      return found === null ? null : partOf(url, placeOf(range, found));
    });
  }

  /** Returns the result of a job; undefined if there is no such file. */
  private async noted<T>(job: () => Promise<T | null>): Promise<T | undefined> {
    try {
      const found = await job();
      if (found === null) return undefined;
      this.hasRead = true;
      this.refusal = null;
      return found;
    } catch (error) {
      if (!(error instanceof RefusedError)) throw error;
      if (!this.hasRead) this.refusal ??= error;
      return undefined;
    }
  }

  private at(key: string): URL {
    const url = new URL(this.root);
    const path = key.split("/").map(encodeURIComponent).join("/");
    url.pathname = url.pathname.replace(/\/*$/, "") + path;
    return url;
  }
}
