/** The websocket to the build behind the page. It connects again whenever the connection is lost. */
import { type BuildState, readBuildState } from "./build_state";

export type Command = "pause" | "continue" | "cancel";

/** Time after which a lost connection is tried again, ms: first, and at most. */
const FIRST_MS = 500;
const MOST_MS = 10_000;

export class BuildFeed {
  private socket: WebSocket | null = null;
  private wait_ms = FIRST_MS;
  private timer = 0;
  private isDisposed = false;

  /** @param onState is given each state; null: the server does not answer */
  constructor(
    private readonly address: string,
    private readonly onState: (state: BuildState | null) => void,
  ) {
    this.connect();
  }

  send(command: Command): void {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(command);
  }

  dispose(): void {
    this.isDisposed = true;
    clearTimeout(this.timer);
    this.socket?.close();
  }

  private connect(): void {
    const socket = new WebSocket(this.address);
    this.socket = socket;
    socket.addEventListener("message", ({ data }) => {
      const state = typeof data === "string" ? readBuildState(data) : null;
      if (state === null) return;
      this.wait_ms = FIRST_MS;
      this.onState(state);
    });
    socket.addEventListener("close", () => {
      if (this.isDisposed) return;
      this.onState(null);
      this.timer = window.setTimeout(() => this.connect(), this.wait_ms);
      this.wait_ms = Math.min(MOST_MS, 2 * this.wait_ms);
    });
  }
}
