/** A websocket that reconnects after each loss of the connection. */

/** Milliseconds until a lost connection is tried again: after the first loss, and at most. */
const FIRST_MS = 500;
const MOST_MS = 10_000;

export class LastingSocket {
  private socket: WebSocket | null = null;
  private wait_ms = FIRST_MS;
  private timer = 0;
  private isDisposed = false;

  /**
   * @param onMessage receives each text; returns whether the page knows the message
   * @param onLost called when the server does not answer
   */
  constructor(
    private readonly address: string,
    private readonly onMessage: (text: string) => boolean,
    private readonly onLost: () => void,
  ) {
    this.connect();
  }

  send(text: string): void {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(text);
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
      if (typeof data === "string" && this.onMessage(data)) this.wait_ms = FIRST_MS;
    });
    socket.addEventListener("close", () => {
      if (this.isDisposed) return;
      this.onLost();
      this.timer = window.setTimeout(() => this.connect(), this.wait_ms);
      this.wait_ms = Math.min(MOST_MS, 2 * this.wait_ms);
    });
  }
}
