/** Runs commands: those of the parts, of the host, and those that move the specimen or the camera. */
import { type Command, UNAVAILABLE, UNCHANGED_VIEW } from "../state/commands";
import type { CommandTable, PartHost } from "./part";
import type { Parts } from "./parts";
import type { Taps } from "./taps";

/**
 * Commands that move the camera. A move that the user made before one of them becomes a separate
 * undo step.
 */
const CAMERA_COMMANDS: ReadonlySet<Command> = new Set(["front", "side", "top", "reset"]);
const NOTHING_AHEAD = "Nothing is in the middle of the view.";

export type CommandOptions = Readonly<{
  host: PartHost;
  parts: Parts;
  taps: Taps;
  /** Requests all files again that failed to load. */
  retry: () => void;
}>;

export class Commands {
  constructor(private readonly options: CommandOptions) {}

  /**
   * Runs a command. Returns whether that was possible.
   *
   * @param isOnPage false: the panel in the scene has sent the command
   */
  run(command: Command, isOnPage: boolean): boolean {
    const { host, parts } = this.options;
    const { state, viewpoint } = host;
    const before = host.isInStereo ? null : viewpoint.cameraPose;
    if (parts.run(command, isOnPage)) return true;
    if (CAMERA_COMMANDS.has(command)) host.undo.noteCameraMove();
    if (!this.runOwn(command)) {
      host.announce(UNAVAILABLE);
      return false;
    }
    const unchanged = UNCHANGED_VIEW[command];
    const isSame = host.state === state && before !== null && viewpoint.isAt(before);
    if (isSame && unchanged !== undefined) host.announce(unchanged);
    host.display.redraw();
    return true;
  }

  private runOwn(command: Command): boolean {
    const own = this.own[command];
    if (own !== undefined) return own() !== false;
    const { host } = this.options;
    const { navigation } = host.viewpoint;
    return host.isInStereo ? host.stereo.run(command, host.state) : navigation.run(command);
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
      if (host.isInStereo) return host.stereo.run("press", host.state);
      if (!taps.tap(host.viewpoint.rayAhead, "key")) host.announce(NOTHING_AHEAD);
      return true;
    },
  };
}
