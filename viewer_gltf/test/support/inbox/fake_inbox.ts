/** A small server with the interface of the inbox, which cuts connections on request of a test. */
import { createHash } from "node:crypto";
import { readFile } from "node:fs/promises";
import { createServer, type IncomingMessage, type Server, type ServerResponse } from "node:http";
import type { AddressInfo } from "node:net";
import { extname, join } from "node:path";
import type { Duplex } from "node:stream";

const TYPES: Readonly<Record<string, string>> = {
  ".html": "text/html; charset=utf-8",
  ".js": "text/javascript",
  ".css": "text/css",
  ".svg": "image/svg+xml",
};
/** Constant of the websocket handshake (RFC 6455). */
const GUID = "258EAFA5-E914-47DA-95CA-C5AB0DC85B11";

export type FakeItem = Record<string, unknown> & { id: string; doing: string; bytes: number };

export const LIMITS = { bytes: 1e10, files: 5000, piece: 2 ** 18, free_bytes: 1e11, hours: 24 };

export class FakeInbox {
  items: FakeItem[] = [];
  mayUpload = true;
  understood: unknown = {};
  /** Image files of the middle slices, by address; without one, the viewer's icon is sent. */
  readonly pictures = new Map<string, string>();
  /** Byte offsets in the upload at which a connection is cut, once each. */
  readonly cuts: number[] = [];
  /** Requests other than those for bytes, for example `POST items/i1/build {"keep_upload":false}`. */
  readonly requests: string[] = [];
  /** Bytes that have arrived and lists of files, by item. */
  readonly arrived = new Map<string, Buffer>();
  readonly lists = new Map<string, readonly (readonly [string, number])[]>();
  /** Delay of each piece, ms. */
  delay_ms = 0;
  private readonly sockets = new Set<Duplex>();
  private readonly server: Server;

  private constructor(private readonly dist: string) {
    this.server = createServer((request, response) => {
      this.answer(request, response).catch(() => response.destroy());
    });
    this.server.on("upgrade", (request, socket) => this.open(request, socket));
  }

  static async start(dist: string): Promise<FakeInbox> {
    const made = new FakeInbox(dist);
    await new Promise<void>((resolve) => made.server.listen(0, "127.0.0.1", resolve));
    return made;
  }

  get address(): string {
    return `http://127.0.0.1:${(this.server.address() as AddressInfo).port}/`;
  }

  reset(): void {
    this.items = [];
    this.mayUpload = true;
    this.cuts.length = 0;
    this.requests.length = 0;
    this.arrived.clear();
    this.lists.clear();
    this.delay_ms = 0;
  }

  async stop(): Promise<void> {
    for (const socket of this.sockets) socket.destroy();
    this.server.closeAllConnections();
    await new Promise<void>((resolve) => this.server.close(() => resolve()));
  }

  /** Changes an item, and sends the new state to all clients. */
  change(id: string, changes: Readonly<Record<string, unknown>>): void {
    this.items = this.items.map((item) => (item.id === id ? { ...item, ...changes } : item));
    this.report();
  }

  report(): void {
    for (const socket of this.sockets) socket.write(frameOf(this.state));
  }

  private get state(): string {
    return JSON.stringify({ items: this.items, limits: LIMITS, may_upload: this.mayUpload });
  }

  private open(request: IncomingMessage, socket: Duplex): void {
    const key = request.headers["sec-websocket-key"] ?? "";
    const accept = createHash("sha1").update(`${key}${GUID}`).digest("base64");
    socket.write(
      "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n" +
        `Sec-WebSocket-Accept: ${accept}\r\n\r\n`,
    );
    this.sockets.add(socket);
    socket.on("error", () => undefined);
    socket.on("data", () => undefined);
    socket.on("close", () => this.sockets.delete(socket));
    socket.write(frameOf(this.state));
  }

  private async answer(request: IncomingMessage, response: ServerResponse): Promise<void> {
    const { pathname } = new URL(request.url ?? "/", "http://host");
    const path = pathname.slice(1);
    const [, id = "", action = ""] = /^items\/([^/]+)\/?(.*)$/.exec(path) ?? [];
    if (action === "bytes") return this.takeBytes(id, request, response);
    if (!path.startsWith("items")) return this.sendFile(path || "inbox.html", response);
    if (action.startsWith("slices/")) {
      const picture = this.pictures.get(action) ?? join(this.dist, "icon-192.png");
      response.writeHead(200, { "Content-Type": "image/png" }).end(await readFile(picture));
      return;
    }
    const body = (await readAll(request)).toString();
    if (request.method !== "GET") this.requests.push(`${request.method} ${path} ${body}`.trim());
    const send = (status: number, content?: unknown) =>
      response
        .writeHead(status, { "Content-Type": "application/json" })
        .end(content === undefined ? "" : JSON.stringify(content));
    if (path === "items") send(...this.begin(JSON.parse(body)));
    else if (action === "understood") send(200, this.understood);
    else if (action === "look") send(200, { page: `items/${id}/view/` });
    else if (action === "view/") response.writeHead(200, TEXT).end("<title>The view</title>");
    else if (request.method === "DELETE") {
      this.items = this.items.filter((item) => item.id !== id);
      send(204);
    } else send(202);
    this.report();
  }

  private begin(request: { files?: [string, number][]; address?: string }): [number, unknown] {
    const digest = JSON.stringify(request.files ?? request.address);
    const id = `i${createHash("sha256").update(digest).digest("hex").slice(0, 8)}`;
    const known = this.items.find((item) => item.id === id);
    if (known !== undefined) return [200, { id, offset: known.bytes }];
    const files = request.files ?? [];
    const total = files.reduce((sum, [, bytes]) => sum + bytes, 0);
    const title = ""; // the name of a file may be that of a patient
    const doing = request.address === undefined ? "uploading" : "understanding";
    const item = { id, title, doing, line: "", bytes: 0, total, place: 0, share: 0, label: "" };
    const rest = { tiles: 0, all_tiles: 0, left_s: null, page: "", keep_upload: false };
    this.items.push({ ...item, ...rest, has_upload: request.address === undefined });
    this.lists.set(id, files);
    this.arrived.set(id, Buffer.alloc(0));
    return [201, { id, offset: 0 }];
  }

  private async takeBytes(
    id: string,
    request: IncomingMessage,
    response: ServerResponse,
  ): Promise<void> {
    let kept = this.arrived.get(id);
    const item = this.items.find((each) => each.id === id);
    if (kept === undefined || item === undefined) {
      response.writeHead(404).end('{"line": "It was deleted."}');
      return;
    }
    const keep = (bytes: Buffer) => {
      kept = bytes;
      this.arrived.set(id, bytes);
      item.bytes = bytes.length;
    };
    const reply = (status: number) =>
      response.writeHead(status, { "Upload-Offset": String(kept?.length ?? 0) }).end();
    if (request.method === "HEAD") return void reply(200);
    const isNext = Number(request.headers["upload-offset"]) === kept.length;
    for await (const chunk of request) {
      if (!isNext) continue;
      const all: Buffer = Buffer.concat([kept, chunk]);
      const at = this.cuts.findIndex((place) => kept !== undefined && all.length >= place);
      keep(at === -1 ? all : all.subarray(0, this.cuts[at]));
      if (at === -1) continue;
      this.cuts.splice(at, 1);
      request.socket.destroy();
      return;
    }
    if (this.delay_ms > 0) await new Promise((resolve) => setTimeout(resolve, this.delay_ms));
    reply(isNext ? 204 : 409);
    if (kept.length === item.total) this.change(id, { doing: "understood" });
    else this.report();
  }

  private async sendFile(path: string, response: ServerResponse): Promise<void> {
    try {
      const content = await readFile(join(this.dist, path));
      response.writeHead(200, { "Content-Type": TYPES[extname(path)] ?? "text/html" }).end(content);
    } catch {
      response.writeHead(404).end();
    }
  }
}

const TEXT = { "Content-Type": "text/html" };

async function readAll(request: IncomingMessage): Promise<Buffer> {
  const chunks: Buffer[] = [];
  for await (const chunk of request) chunks.push(chunk);
  return Buffer.concat(chunks);
}

/** Returns a text as one frame of a websocket. */
function frameOf(text: string): Buffer {
  const content = Buffer.from(text);
  const head = Buffer.from([0x81, 126, content.length >> 8, content.length & 255]);
  if (content.length < 126) return Buffer.concat([Buffer.from([0x81, content.length]), content]);
  return Buffer.concat([head, content]);
}
