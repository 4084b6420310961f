/** Messages between the main thread and its worker for `/bricks`. */
import { TemporaryError } from "../../bundle/errors";
import { noteWait } from "../../bundle/retry";
import { type BrickView, TEXEL_PX } from "./protocol";
import { parseTable, STORED_BYTES, type Table } from "./tree";

export type LinkRequest =
  | Readonly<{ type: "connect"; address: string }>
  | Readonly<{ type: "open"; tile: string; channel: string; source: string }>
  | Readonly<{ type: "close"; tile: string; channel: string }>
  | (Readonly<{ type: "view"; texel_px: number; budget: number }> & BrickView);

export type LinkMessage =
  | Readonly<{ type: "tree"; tile: string; channel: string; table: Uint8Array<ArrayBuffer> }>
  | Readonly<{
      type: "bricks";
      tile: string;
      channel: string;
      nodes: Uint32Array<ArrayBuffer>;
      /** Texels of the bricks, one after another: 18^3 bytes for each node. */
      texels: Uint8Array<ArrayBuffer>;
    }>
  | Readonly<{ type: "done" }>
  | Readonly<{ type: "refused"; tile: string; channel: string; text: string }>
  /** The answer could not be read; the connection is made again. */
  | Readonly<{ type: "fault"; text: string }>
  /** The host does not answer and is tried again, or it answers again. */
  | Readonly<{ type: "away"; isAway: boolean }>
  | Readonly<{ type: "lost"; reason: string }>;

export type Brick = Readonly<{ node: number; texels: Uint8Array<ArrayBuffer> }>;

/** The receiver of one volume's bricks. */
export type BrickReceiver = Readonly<{
  onTable: (table: Table) => void;
  onBricks: (bricks: readonly Brick[]) => void;
  onRefused: (text: string) => void;
}>;

/** Least time, in milliseconds, between two requests for the bricks of a view. */
const VIEW_EVERY_MS = 200;
/** Bytes of bricks for one view, at most; bricks with the largest error come first. */
const BUDGET_BYTES = 64 * 1024 * 1024;

export class BrickLink {
  isBusy = false;
  private readonly worker: Worker;
  private readonly receivers = new Map<string, BrickReceiver>();
  private last = "";
  private asked_ms = 0;
  /** Whether there is a connection, or may be one soon. */
  isOpen = true;
  /** Whether the host does not answer now. Loaded bricks stay, and nothing is waited for. */
  isAway = false;

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

  /** Receives the bricks of a volume from the start, including those that were loaded before. */
  open(tile: string, channel: string, source: string, receiver: BrickReceiver): void {
    this.receivers.set(`${tile}/${channel}`, receiver);
    this.isBusy = !this.isAway;
    this.last = ""; // makes the next `look` request bricks, even if the view has not changed
    this.post({ type: "open", tile, channel, source });
  }

  close(tile: string, channel: string, receiver: BrickReceiver): void {
    const name = `${tile}/${channel}`;
    if (this.receivers.get(name) !== receiver) return;
    this.receivers.delete(name);
    this.post({ type: "close", tile, channel });
  }

  /** Requests the bricks that the camera's present view needs. Call it in every frame. */
  look(view: BrickView, now_ms: number): void {
    if (
      !this.isOpen ||
      this.isAway ||
      this.receivers.size === 0 ||
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
        this.receivers.get(name)?.onTable(parseTable(message.table, `/bricks: ${name}`));
        break;
      }
      case "bricks": {
        const bricks = Array.from(message.nodes, (node, i) => ({
          node,
          texels: message.texels.subarray(i * STORED_BYTES, (i + 1) * STORED_BYTES),
        }));
        this.receivers.get(`${message.tile}/${message.channel}`)?.onBricks(bricks);
        break;
      }
      case "done":
        this.isBusy = false;
        this.onDone();
        break;
      case "refused":
        this.receivers.get(`${message.tile}/${message.channel}`)?.onRefused(message.text);
        break;
      case "fault":
        this.onError(new TemporaryError(message.text, { notice: message.text }));
        break;
      case "away":
        this.setAway(message.isAway);
        break;
      case "lost":
        this.isOpen = this.isBusy = false;
        for (const receiver of this.receivers.values())
          receiver.onRefused("the connection was lost");
        break;
    }
  }

  private setAway(isAway: boolean): void {
    if (isAway) this.isBusy = false;
    else this.isOpen = true;
    if (isAway === this.isAway) return;
    this.isAway = isAway;
    this.last = ""; // makes the next `look` request bricks, even if the view has not changed
    noteWait(isAway);
    this.onDone();
  }

  private post(request: LinkRequest): void {
    this.worker.postMessage(request);
  }

  dispose(): void {
    if (this.isAway) noteWait(false);
    this.worker.terminate();
    this.receivers.clear();
  }
}
