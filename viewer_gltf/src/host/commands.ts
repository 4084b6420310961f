/** Carries out commands: those of the parts, the host's own, and those that move the specimen or the camera. */
import { CANT, type Command, STAYS } from "../state/commands";
import type { CommandTable, PartHost } from "./part";
import type { Parts } from "./parts";
import type { Taps } from "./taps";

/** Commands before which the place from which the specimen is seen is a step of its own. */
const ENDS_A_LOOK: ReadonlySet<Command> = new Set(["front", "side", "top", "reset"]);
const NOTHING_AHEAD = "Nothing is in the middle of the view.";

export type CommandOptions = Readonly<{
  host: PartHost;
  parts: Parts;
  taps: Taps;
  /** Asks again for all that has failed. */
  retry: () => void;
}>;

export class Commands {
  constructor(private readonly options: CommandOptions) {}

  /**
   * Returns whether the command could be carried out.
   *
   * @param isOnPage false: by the panel in the room
   */
  run(command: Command, isOnPage: boolean): boolean {
    const { host, parts } = this.options;
    const { state, viewpoint } = host;
    const before = host.isInRoom ? null : viewpoint.cameraPose;
    if (parts.run(command, isOnPage)) return true;
    if (ENDS_A_LOOK.has(command)) host.undo.noteLook();
    if (!this.carryOut(command)) {
      host.announce(CANT);
      return false;
    }
    const stays = STAYS[command];
    const isSame = host.state === state && before !== null && viewpoint.isAt(before);
    if (isSame && stays !== undefined) host.announce(stays);
    host.display.redraw();
    return true;
  }

  private carryOut(command: Command): boolean {
    const own = this.own[command];
    if (own !== undefined) return own() !== false;
    const { host } = this.options;
    const { navigation } = host.viewpoint;
    return host.isInRoom ? host.stereo.run(command, host.state) : navigation.run(command);
  }

  /** The host's own commands. */
  private readonly own: CommandTable = {
    undo: () => this.options.host.undo.step("undo"),
    redo: () => this.options.host.undo.step("redo"),
    reset: () => {
      const { host } = this.options;
      host.dispatch({ type: "isolate", tile: null });
      host.viewpoint.recentre();
    },
    back: () => {
      const { host } = this.options;
      const type = host.state.isolated !== null ? "isolate" : "select";
      host.dispatch({ type, tile: null });
    },
    retry: () => this.options.retry(),
    press: () => {
      const { host, taps } = this.options;
      if (host.isInRoom) return host.stereo.run("press", host.state);
      if (!taps.tap(host.viewpoint.rayAhead, "key")) host.announce(NOTHING_AHEAD);
      return true;
    },
  };
}
