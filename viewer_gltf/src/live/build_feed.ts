/** The websocket to the build behind the page. */
import { LastingSocket } from "../dom/lasting_socket";
import { type BuildState, readBuildState } from "./build_state";

export type Command = "pause" | "continue" | "cancel";
/** Frames are late: the build shall rest for a moment. */
const LATE = "late";

export class BuildFeed {
  private readonly socket: LastingSocket;

  /** @param onState is given each state; null: the server does not answer */
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
