/** Messages over the view, as a part of the viewer. Their code is loaded when the first message is due. */
import type { Part, PartDefinition, PartHost } from "../host/part";
import type { MessageButtons } from "../host/services";
import type { ViewerState } from "../state/viewer_state";
import type { PictureMessage } from "./picture_message";

/** Parts of the state that can make the view empty. */
const EMPTYING = ["channels", "clip", "isolated", "selected", "objects"] as const;

/** Returns whether a setting may have made the view empty, so that the code that reports it is loaded. */
const mayBeEmpty = (state: ViewerState, opening: ViewerState) =>
  EMPTYING.some((key) => state[key] !== opening[key]) ||
  (state.mode === "off" && !state.channels.some(({ shown, hasSurface }) => shown && hasSurface));

class MessagesPart implements Part, MessageButtons {
  readonly id = "messages";
  readonly services = { messages: this };
  private message: PictureMessage | null = null;
  /** The state in which the bundle opened. */
  private readonly opening: ViewerState;

  constructor(private readonly host: PartHost) {
    this.opening = host.state;
    host.panel.onShown(() => this.update());
  }

  private update(): void {
    if (mayBeEmpty(this.host.state, this.opening)) void this.load();
    this.message?.update();
  }

  private async load(): Promise<PictureMessage | null> {
    if (this.message !== null) return this.message;
    const part = await import("./picture_message").catch(() => null);
    if (part === null || this.message !== null) return this.message;
    this.message = new part.PictureMessage(this.host, this.opening);
    this.message.update();
    return this.message;
  }

  async buttonFor(refusal: string): ReturnType<MessageButtons["buttonFor"]> {
    return (await this.load())?.buttonFor(refusal) ?? null;
  }

  dispose(): void {
    this.message?.dispose();
  }
}

export const messages: PartDefinition = {
  id: "messages",
  create: (host) => new MessagesPart(host),
};
