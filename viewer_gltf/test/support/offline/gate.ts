/** A proxy of a host that a test can shut. All connections then break, as without a network. */

import type { AddressInfo } from "node:net";
import { connect, createServer, type Server, type Socket } from "node:net";

export class Gate {
  isOpen = true;
  private readonly sockets = new Set<Socket>();

  private constructor(
    private readonly server: Server,
    readonly address: string,
  ) {}

  /** @param host address, for example http://127.0.0.1:8000 */
  static async before(host: string): Promise<Gate> {
    const { hostname, port } = new URL(host);
    const server = createServer((inner) => {
      if (!gate.isOpen) {
        inner.destroy();
        return;
      }
      const outer = connect(Number(port), hostname);
      inner.pipe(outer);
      outer.pipe(inner);
      for (const [socket, other] of [
        [inner, outer],
        [outer, inner],
      ]) {
        gate.sockets.add(socket);
        socket.on("error", () => other.destroy());
        socket.on("close", () => gate.sockets.delete(socket));
      }
    });
    await new Promise<void>((resolve) => server.listen(0, "127.0.0.1", resolve));
    const gate = new Gate(server, `http://127.0.0.1:${(server.address() as AddressInfo).port}`);
    return gate;
  }

  /** Breaks present connections, and rejects new ones. */
  shut(): void {
    this.isOpen = false;
    for (const socket of this.sockets) socket.destroy();
  }

  open(): void {
    this.isOpen = true;
  }

  stop(): Promise<void> {
    this.shut();
    return new Promise((resolve) => {
      this.server.close(() => resolve());
    });
  }
}
