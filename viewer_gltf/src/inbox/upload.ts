/**
 * Sends the files of one item in pieces. After a lost connection the upload waits and then continues by itself from the
 * bytes that have arrived. Each further wait is longer.
 */
import { findUnreadable, type PieceAnswer, type Server } from "./server";
import type { UploadFiles } from "./upload_files";

export type Progress = Readonly<{
  /** `waiting`: another upload is sent first. `lost`: the connection is lost and will be tried again. `refused`: final. */
  doing: "waiting" | "sending" | "lost" | "refused" | "cancelled" | "complete";
  sent: number;
  total: number;
  /** Time until all bytes are sent, s; null: not known. */
  left_s: number | null;
  /** Why the upload is lost or refused; empty: it is neither. */
  line: string;
}>;

/** Time that a piece should take, s. It is the interval of the progress, and limits what is sent again after a fault. */
const PIECE_S = 1.5;
const FIRST_BYTES = 2 ** 20;
const LEAST_BYTES = 2 ** 16;
/** Shortest and longest wait before a lost connection is tried again, ms. */
const FIRST_WAIT_MS = 500;
const MOST_WAIT_MS = 30_000;
/** Weight of the last piece in the mean rate, 0..1. */
const NEWEST_SHARE = 0.2;

/**
 * A piece of the stream from `start` to `end`. `content` refers to the bytes and does not copy them. The piece is read
 * once before it is sent. A file that can't be read is thus noticed, and not mistaken for a lost connection. (Sending
 * the bytes as an array in memory is ten times slower in Chromium.)
 */
type Piece = Readonly<{ start: number; end: number; content: Blob; isReadable: Promise<boolean> }>;

/** Returns whether a status is temporary: the server is busy, full or restarting. */
const isPassing = (status: number) => status >= 500 || status === 408 || status === 429;

export class Upload {
  private pieceBytes = FIRST_BYTES;
  /** Mean rate in bytes per second; null: nothing was sent yet. */
  private rate: number | null = null;
  /** The next piece. It is prepared while the current one is sent, because many files take time to open. */
  private next: Piece | null = null;
  private wait_ms = FIRST_WAIT_MS;
  private readonly cancelled = new AbortController();
  /** Ends the current request or wait, without ending the upload. */
  private interruption = new AbortController();
  private state: Progress;

  /** @param offset number of bytes that the server already has */
  constructor(
    readonly id: string,
    private readonly files: UploadFiles,
    offset: number,
    private readonly server: Server,
    private readonly mostBytes: number,
    private readonly onProgress: (progress: Progress) => void,
  ) {
    this.state = { doing: "waiting", sent: offset, total: files.bytes, left_s: null, line: "" };
  }

  get progress(): Progress {
    return this.state;
  }

  get isOver(): boolean {
    return ["refused", "cancelled", "complete"].includes(this.state.doing);
  }

  /** Stops sending. The bytes that have arrived stay on the server until the item is deleted. */
  cancel(): void {
    this.cancelled.abort();
    this.report({ doing: "cancelled", left_s: null });
  }

  /** Tries a lost connection at once. */
  retryNow(): void {
    if (this.state.doing === "lost") this.interruption.abort();
  }

  /** Treats the current request as lost, because the browser is offline. */
  loseConnection(): void {
    if (this.state.doing === "sending") this.interruption.abort();
  }

  /** Resolves when all bytes have arrived, or when the upload was refused or cancelled. */
  async run(): Promise<void> {
    this.report({ doing: "sending" });
    while (!this.isOver) {
      if (this.state.sent >= this.state.total) this.report({ doing: "complete", left_s: null });
      else if (this.state.doing === "lost") await this.recover();
      else await this.sendNext();
    }
  }

  private async sendNext(): Promise<void> {
    const { sent } = this.state;
    const piece = this.next?.start === sent ? this.next : this.read(sent);
    const { end, content } = piece;
    this.next = null;
    const isReadable = await piece.isReadable;
    if (this.isOver) return;
    if (!isReadable) {
      const name = await findUnreadable(this.files.filesIn(sent, end));
      this.refuse(`${name ?? "A file"} has changed or is gone. Drop the files again.`);
      return;
    }
    if (end < this.state.total) this.next = this.read(end);
    const began_ms = performance.now();
    const answer = await this.attempt((signal) =>
      this.server.sendPiece(this.id, sent, content, signal),
    );
    if (this.isOver) return;
    if (answer === null) {
      this.lose("");
      return;
    }
    const { status, offset } = answer;
    if (status === 409 && offset !== null && offset !== sent) this.moveTo(offset);
    else if (status === 409 || isPassing(status)) this.lose(answer.line);
    else if (status >= 300) this.refuse(answer.line);
    else {
      this.measure(end - sent, (performance.now() - began_ms) / 1000);
      this.moveTo(offset ?? end);
    }
  }

  private read(start: number): Piece {
    const end = Math.min(this.state.total, start + Math.min(this.pieceBytes, this.mostBytes));
    const content = this.files.piece(start, end);
    const isReadable = content.arrayBuffer().then(
      () => true,
      () => false,
    );
    return { start, end, content, isReadable };
  }

  /** Waits, and then asks the server how many bytes have arrived. */
  private async recover(): Promise<void> {
    await this.wait(this.wait_ms);
    this.wait_ms = Math.min(MOST_WAIT_MS, 2 * this.wait_ms);
    const answer = await this.attempt((signal) => this.server.askOffset(this.id, signal));
    if (answer === null || this.isOver) return;
    if (answer.offset !== null && answer.status < 300) {
      this.report({ doing: "sending", line: "" });
      this.place(answer.offset);
    } else if (!isPassing(answer.status)) this.refuse(answer.line || "The upload was deleted.");
  }

  /** Returns the answer of the server; null: the connection is lost. */
  private async attempt(
    request: (signal: AbortSignal) => Promise<PieceAnswer>,
  ): Promise<PieceAnswer | null> {
    this.interruption = new AbortController();
    const either = AbortSignal.any([this.cancelled.signal, this.interruption.signal]);
    try {
      return await request(either);
    } catch {
      return null;
    }
  }

  private async wait(time_ms: number): Promise<void> {
    this.interruption = new AbortController();
    const either = AbortSignal.any([this.cancelled.signal, this.interruption.signal]);
    await new Promise<void>((resolve) => {
      const timer = setTimeout(resolve, time_ms);
      either.addEventListener("abort", () => {
        clearTimeout(timer);
        resolve();
      });
    });
  }

  private measure(bytes: number, took_s: number): void {
    const rate = bytes / Math.max(took_s, 1e-3);
    this.rate = this.rate === null ? rate : this.rate + NEWEST_SHARE * (rate - this.rate);
    // pieces grow to at most twice their size, because a single answer is a poor estimate of the rate
    const wanted = Math.min(rate * PIECE_S, 2 * this.pieceBytes);
    this.pieceBytes = Math.max(LEAST_BYTES, Math.round(wanted));
  }

  /** Continues from the number of bytes that the server has. The next wait is short again, because the server answers. */
  private moveTo(offset: number): void {
    this.wait_ms = FIRST_WAIT_MS;
    this.place(offset);
  }

  private place(offset: number): void {
    const sent = Math.min(offset, this.state.total);
    const left_s = this.rate === null ? null : (this.state.total - sent) / this.rate;
    this.report({ sent, left_s });
  }

  private lose(line: string): void {
    this.pieceBytes = Math.max(LEAST_BYTES, Math.round(this.pieceBytes / 2));
    this.report({ doing: "lost", left_s: null, line });
  }

  private refuse(line: string): void {
    this.report({ doing: "refused", left_s: null, line });
  }

  private report(changes: Partial<Progress>): void {
    if (this.isOver) return;
    this.state = { ...this.state, ...changes };
    this.onProgress(this.state);
  }
}
