/** A static host on localhost for tests, with or without HTTP ranges, that records requests. */
import { readFile } from "node:fs/promises";
import { createServer, type Server } from "node:http";
import type { AddressInfo } from "node:net";
import { extname, join, normalize } from "node:path";

const TYPES: Readonly<Record<string, string>> = {
  ".html": "text/html; charset=utf-8",
  ".js": "text/javascript",
  ".css": "text/css",
  ".json": "application/json",
  ".wasm": "application/wasm",
  ".glb": "model/gltf-binary",
  ".ktx2": "image/ktx2",
  ".png": "image/png",
  ".svg": "image/svg+xml",
  ".usdz": "model/vnd.usdz+zip",
  ".webmanifest": "application/manifest+json",
};

export type Request = Readonly<{ path: string; query: string; range: string | null }>;
/** `times`: number of requests with this answer; later ones get the file of the folder. */
export type Answer = { status: number; body: string | Uint8Array; times?: number };

export class Host {
  readonly requests: Request[] = [];
  /** Answers by path, in place of the files of the folder. */
  readonly overrides = new Map<string, Answer>();
  hasRanges = true;
  /** Headers of every answer, besides its own. */
  headers: Readonly<Record<string, string>> = {};
  /** Delay of every answer. */
  delay_ms = 0;

  private constructor(
    private readonly server: Server,
    readonly address: string,
  ) {}

  /** Serves folders under their prefixes, for example `{"/": dist, "/bundle/": bundle}`. */
  static async start(mounts: Readonly<Record<string, string>>): Promise<Host> {
    const prefixes = Object.keys(mounts).sort((a, b) => b.length - a.length);
    const server = createServer((request, response) => {
      const { pathname, search } = new URL(request.url ?? "/", "http://host");
      const path = decodeURIComponent(pathname);
      const range = request.headers.range ?? null;
      host.requests.push({ path, query: search, range });
      const prefix = prefixes.find((each) => path.startsWith(each));
      const inside = prefix === undefined ? "" : normalize(path.slice(prefix.length));
      const file =
        prefix === undefined || inside.startsWith("..")
          ? null
          : join(mounts[prefix], inside.endsWith("/") || inside === "." ? "index.html" : inside);
      const answer = host.overrides.get(path);
      if (answer?.times !== undefined && --answer.times === 0) host.overrides.delete(path);
      const content =
        answer !== undefined
          ? Promise.resolve(Buffer.from(answer.body))
          : file === null
            ? Promise.reject(new Error("outside"))
            : readFile(file);
      content.then(
        async (bytes) => {
          if (host.delay_ms > 0) await new Promise((done) => setTimeout(done, host.delay_ms));
          const type = TYPES[extname(path)] ?? "text/html";
          const length = { "Content-Length": String(bytes.length) };
          const sized = request.method === "HEAD" ? length : {};
          const headers = { ...host.headers, "Content-Type": type, ...sized };
          const bounds =
            host.hasRanges && answer === undefined ? /^bytes=(\d+)-(\d+)$/.exec(range ?? "") : null;
          if (bounds === null) {
            response.writeHead(answer?.status ?? 200, headers).end(bytes);
            return;
          }
          const part = bytes.subarray(Number(bounds[1]), Number(bounds[2]) + 1);
          const last = Number(bounds[1]) + part.length - 1;
          response
            .writeHead(206, {
              ...headers,
              "Content-Range": `bytes ${bounds[1]}-${last}/${bytes.length}`,
            })
            .end(part);
        },
        () => response.writeHead(404).end("not found"),
      );
    });
    await new Promise<void>((resolve) => server.listen(0, "127.0.0.1", resolve));
    const host = new Host(server, `http://127.0.0.1:${(server.address() as AddressInfo).port}`);
    return host;
  }

  /** Forgets the requests and all changes of answers. */
  reset(): void {
    this.requests.length = 0;
    this.overrides.clear();
    this.hasRanges = true;
    this.headers = {};
    this.delay_ms = 0;
  }

  stop(): Promise<void> {
    this.server.closeAllConnections();
    return new Promise((resolve) => {
      this.server.close(() => resolve());
    });
  }
}
