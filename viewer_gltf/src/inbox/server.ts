/** The requests of the inbox to the server, one method for each. */

import { pageOf, positive, textOf } from "./inbox_state";
import { inPageWords } from "./page_words";
import { readUnderstood, type Understood } from "./understood";
import type { NamedFile, UploadFiles } from "./upload_files";

/** Error of a request that the server has refused. Its message is the server's reason in one line. */
export class RefusedError extends Error {
  override name = "RefusedError";

  constructor(
    readonly status: number,
    line: string,
  ) {
    super(line);
  }
}

/** Settings that the user has changed. Absent settings stay as they are. */
export type Choices = Readonly<
  Partial<{
    preset: string;
    channels: readonly string[];
    series: string;
    background: string;
    title: string;
    /** Voxel spacing along x, y, z. */
    spacing_um: readonly number[];
  }>
>;

export type Command = "pause" | "continue" | "cancel";

/**
 * An upload that has begun: the ID of its item, and the number of bytes that the server already
 * has.
 */
export type Begun = Readonly<{ id: string; offset: number }>;
/** The answer to a piece. `offset` is the number of bytes that have arrived; null: the server does not state it. */
export type PieceAnswer = Readonly<{ status: number; offset: number | null; line: string }>;

/** Largest length of a message of the server, characters. */
const LONGEST = 600;
/** Time after which a request without an answer counts as lost, ms. */
const PATIENCE_MS = 30_000;

export class Server {
  /** @param root the page's own folder */
  constructor(
    private readonly root: string,
    private readonly request: typeof fetch = (...given) => fetch(...given),
  ) {}

  /** Starts an upload, or finds the unfinished upload of the same files. */
  async begin(files: UploadFiles): Promise<Begun> {
    const content = { files: files.list, mark: await files.mark() };
    return begunOf(await this.json("POST", "items", content));
  }

  async addAddress(address: string): Promise<Begun> {
    return begunOf(await this.json("POST", "items", { address }));
  }

  async understood(id: string): Promise<Understood> {
    return readUnderstood(await this.json("GET", `items/${id}/understood`));
  }

  async choose(id: string, choices: Choices): Promise<void> {
    await this.json("PUT", `items/${id}/choices`, choices);
  }

  /** Requests a view of an item. Returns the folder of the view, below this page. */
  async look(id: string): Promise<string> {
    const answer = (await this.json("POST", `items/${id}/look`)) as { page?: unknown } | null;
    const page = pageOf(answer?.page);
    if (page === "") throw new RefusedError(200, "The server names no page for this view.");
    return page;
  }

  async build(id: string, keepsUpload: boolean): Promise<void> {
    await this.json("POST", `items/${id}/build`, { keep_upload: keepsUpload });
  }

  async command(id: string, command: Command): Promise<void> {
    await this.json("POST", `items/${id}/${command}`);
  }

  async remove(id: string): Promise<void> {
    await this.json("DELETE", `items/${id}`);
  }

  /** Sends a piece. Rejects if the connection is lost or `signal` is aborted. */
  async sendPiece(
    id: string,
    offset: number,
    piece: Blob,
    signal: AbortSignal,
  ): Promise<PieceAnswer> {
    const headers = {
      "Upload-Offset": String(offset),
      "Content-Type": "application/offset+octet-stream",
    };
    return this.ask(`items/${id}/bytes`, { method: "PATCH", headers, body: piece, signal });
  }

  /** Asks for the number of bytes that have arrived. */
  async askOffset(id: string, signal: AbortSignal): Promise<PieceAnswer> {
    return this.ask(`items/${id}/bytes`, { method: "HEAD", signal });
  }

  private async ask(path: string, { signal, ...how }: RequestInit): Promise<PieceAnswer> {
    const patience = AbortSignal.timeout(PATIENCE_MS);
    const either = signal ? AbortSignal.any([signal, patience]) : patience;
    const answer = await this.request(this.addressOf(path), { ...how, signal: either });
    const offset = answer.headers.get("Upload-Offset");
    return {
      status: answer.status,
      offset: offset === null || !/^\d+$/.test(offset) ? null : Number(offset),
      line: answer.ok ? "" : await lineOf(answer),
    };
  }

  private async json(method: string, path: string, body?: unknown): Promise<unknown> {
    const sent =
      body === undefined
        ? {}
        : { body: JSON.stringify(body), headers: { "Content-Type": "application/json" } };
    let answer: Response;
    try {
      answer = await this.request(this.addressOf(path), { method, ...sent });
    } catch {
      throw new RefusedError(
        0,
        "The server does not answer. Check the connection, then try again.",
      );
    }
    if (!answer.ok) throw new RefusedError(answer.status, await lineOf(answer));
    const text = await answer.text();
    return text === "" ? null : JSON.parse(text);
  }

  private addressOf(path: string): string {
    return new URL(path, this.root).href;
  }
}

function begunOf(answer: unknown): Begun {
  const { id, offset } = (answer ?? {}) as { id?: unknown; offset?: unknown };
  return { id: textOf(id), offset: positive(offset, 0) };
}

/** Returns the server's reason for a refusal or, if it gives none, the HTTP status. */
async function lineOf(answer: Response): Promise<string> {
  const text = await answer.text().catch(() => "");
  try {
    const { line } = JSON.parse(text) as { line?: unknown };
    if (typeof line === "string" && line !== "") return inPageWords(line);
  } catch {
    // some errors are one line of plain text, and a proxy may answer with a web page
  }
  const type = answer.headers.get("Content-Type") ?? "";
  if (type.startsWith("text/plain") && text !== "") return text.slice(0, LONGEST);
  return `The server has refused this with status ${answer.status}.`;
}

/** Returns the first file that can't be read, because it was changed, moved or removed since it was dropped; or null. */
export async function findUnreadable(files: readonly NamedFile[]): Promise<string | null> {
  for (const { name, file } of files) {
    try {
      await file.slice(0, 1).arrayBuffer();
    } catch {
      return name;
    }
  }
  return null;
}
