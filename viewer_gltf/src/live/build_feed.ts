/** The websocket to the build whose intermediate bundles (views) the page shows. */
import { LastingSocket } from "../dom/lasting_socket";
import { type BuildState, readBuildState } from "./build_state";

export type Command = "pause" | "continue" | "cancel";
/** Message that frames are late; the build then pauses for a moment. */
const LATE = "late";

export class BuildFeed {
  private readonly socket: LastingSocket;

  /** @param onState called with each state, or with null if the server does not answer */
  constructor(address: string, onState: (state: BuildState | null) => void) {
    const read = (text: string) => {
      const state = readBuildState(text);
      if (state !== null) onState(state);
      return state !== null;
    };
    this.socket = new LastingSocket(address, read, () => onState(null));
  }

  send(command: Command): void {
    this.socket.send(command);
  }

  rest(): void {
    this.socket.send(LATE);
  }

  dispose(): void {
    this.socket.dispose();
  }
}
