/** The messages between the thread that draws and its worker for `/bricks`. */
import { TemporaryError } from "../../bundle/errors";
import { noteWait } from "../../bundle/retry";
import { type BrickView, TEXEL_PX } from "./protocol";
import { parseTable, STORED_BYTES, type Table } from "./tree";

export type LinkAsk =
  | Readonly<{ type: "connect"; address: string }>
  | Readonly<{ type: "open"; tile: string; channel: string; source: string }>
  /** Nothing of this volume is wanted any more. */
  | Readonly<{ type: "close"; tile: string; channel: string }>
  | (Readonly<{ type: "view"; texel_px: number; budget: number }> & BrickView);

export type LinkMessage =
  | Readonly<{ type: "tree"; tile: string; channel: string; table: Uint8Array<ArrayBuffer> }>
  | Readonly<{
      type: "bricks";
      tile: string;
      channel: string;
      nodes: Uint32Array<ArrayBuffer>;
      /** 18^3 bytes for each node. */
      texels: Uint8Array<ArrayBuffer>;
    }>
  | Readonly<{ type: "done" }>
  | Readonly<{ type: "refused"; tile: string; channel: string; text: string }>
  /** The answer could not be read; the connection begins anew. */
  | Readonly<{ type: "fault"; text: string }>
  /** The host does not answer, and is tried again; or it answers again. */
  | Readonly<{ type: "away"; isAway: boolean }>
  /** No connection any more. */
  | Readonly<{ type: "lost"; reason: string }>;

export type Brick = Readonly<{ node: number; texels: Uint8Array<ArrayBuffer> }>;

/** A client that draws one volume. */
export type Taker = Readonly<{
  onTable: (table: Table) => void;
  onBricks: (bricks: readonly Brick[]) => void;
  onRefused: (text: string) => void;
}>;

/** Shortest pause between two requests of a view, ms. */
const VIEW_EVERY_MS = 200;
/** Most bytes of bricks for one view: bricks with the largest error come first. */
const BUDGET_BYTES = 64 * 1024 * 1024;

export class BrickLink {
  isBusy = false;
  private readonly worker: Worker;
  private readonly takers = new Map<string, Taker>();
  private last = "";
  private asked_ms = 0;
  /** Whether there is a connection, or may be one soon. */
  isOpen = true;
  /** Whether the host does not answer at present. What has come stays, and nothing is awaited. */
  isAway = false;

  /** @param address of the websocket */
  constructor(
    address: string,
    private readonly onDone: () => void,
    private readonly onError: (error: unknown) => void,
  ) {
    this.worker = new Worker(new URL("./client_worker.ts", import.meta.url), { type: "module" });
    this.worker.addEventListener("message", ({ data }: MessageEvent<LinkMessage>) =>
      this.receive(data),
    );
    this.post({ type: "connect", address });
  }

  /** Take what comes of a volume, from the start: also what came before. */
  open(tile: string, channel: string, source: string, taker: Taker): void {
    this.takers.set(`${tile}/${channel}`, taker);
    this.isBusy = !this.isAway;
    this.last = ""; // the same view then asks for more
    this.post({ type: "open", tile, channel, source });
  }

  close(tile: string, channel: string, taker: Taker): void {
    const name = `${tile}/${channel}`;
    if (this.takers.get(name) !== taker) return;
    this.takers.delete(name);
    this.post({ type: "close", tile, channel });
  }

  /** Sets the present view; to be called in every frame. */
  look(view: BrickView, now_ms: number): void {
    if (
      !this.isOpen ||
      this.isAway ||
      this.takers.size === 0 ||
      now_ms - this.asked_ms < VIEW_EVERY_MS
    )
      return;
    const text = JSON.stringify(view);
    if (text === this.last) return;
    this.last = text;
    this.asked_ms = now_ms;
    this.isBusy = true;
    this.post({ type: "view", texel_px: TEXEL_PX, budget: BUDGET_BYTES, ...view });
  }

  private receive(message: LinkMessage): void {
    switch (message.type) {
      case "tree": {
        const name = `${message.tile}/${message.channel}`;
        this.takers.get(name)?.onTable(parseTable(message.table, `/bricks: ${name}`));
        break;
      }
      case "bricks": {
        const bricks = Array.from(message.nodes, (node, i) => ({
          node,
          texels: message.texels.subarray(i * STORED_BYTES, (i + 1) * STORED_BYTES),
        }));
        this.takers.get(`${message.tile}/${message.channel}`)?.onBricks(bricks);
        break;
      }
      case "done":
        this.isBusy = false;
        this.onDone();
        break;
      case "refused":
        this.takers.get(`${message.tile}/${message.channel}`)?.onRefused(message.text);
        break;
      case "fault":
        this.onError(new TemporaryError(message.text, { notice: message.text }));
        break;
      case "away":
        this.setAway(message.isAway);
        break;
      case "lost":
        this.isOpen = this.isBusy = false;
        for (const taker of this.takers.values()) taker.onRefused("the connection was lost");
        break;
    }
  }

  private setAway(isAway: boolean): void {
    if (isAway) this.isBusy = false;
    else this.isOpen = true;
    if (isAway === this.isAway) return;
    this.isAway = isAway;
    this.last = ""; // the same view asks again
    noteWait(isAway);
    this.onDone();
  }

  private post(ask: LinkAsk): void {
    this.worker.postMessage(ask);
  }

  dispose(): void {
    if (this.isAway) noteWait(false);
    this.worker.terminate();
    this.takers.clear();
  }
}
