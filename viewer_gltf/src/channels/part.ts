/** The channels as a part of the viewer: cards, keys and two-dimensional transfer functions. */
import type { Part, PartDefinition, PartHost } from "../host/part";
import type { PanelView, PartSection } from "../panel/controls";
import { isTwoD } from "../state/transfer_functions_2d";
import { type ViewerState, volumeChannels } from "../state/viewer_state";
import { CHANNEL_KEYS } from "./keys";
import { channelSections } from "./section";
import { TransferFunctions2dLoader } from "./transfer_functions_loader";

class ChannelsPart implements Part {
  readonly id = "channels";
  private readonly loader: TransferFunctions2dLoader;

  constructor(private readonly host: PartHost) {
    this.loader = new TransferFunctions2dLoader(
      host.bundle,
      (channel, transfer2d) => host.dispatch({ type: "learn-transfer-2d", channel, transfer2d }),
      () => host.display.requestFrame(),
      (error) => host.report(error),
    );
  }

  sync(state: ViewerState): void {
    for (const channel of volumeChannels(state)) {
      if (isTwoD(channel)) this.loader.want(channel.id);
    }
  }

  get isLoading(): boolean {
    return this.loader.isLoading;
  }

  panel(view: PanelView): readonly PartSection[] {
    const { state, panel } = this.host;
    const { ranges } = panel;
    const { isHistogramOpen, picked } = view;
    const isSeen = isHistogramOpen && picked !== null && ranges.has(picked);
    const histogram = isSeen ? this.loader.histogram(picked) : null;
    const objectColors = this.host.service("objects")?.colors;
    return channelSections(state, { ranges, histogram, objectColors }, view);
  }

  retryFailed(): void {
    this.loader.retryFailed();
  }

  dispose(): void {}
}

export const channels: PartDefinition = {
  id: "channels",
  keys: CHANNEL_KEYS,
  create: (host) => new ChannelsPart(host),
};
