/** The channels as a part of the viewer: their two-dimensional transfer functions. */
import type { Part, PartDefinition, PartHost } from "../host/part";
import type { Histograms } from "../host/services";
import type { Histogram } from "../panel/controls";
import { isTwoD } from "../state/transfer_functions_2d";
import { type ViewerState, volumeChannels } from "../state/viewer_state";
import { TransferFunctions2dLoader } from "./transfer_functions_loader";

class ChannelsPart implements Part, Histograms {
  readonly id = "channels";
  readonly services = { histograms: this };
  private readonly loader: TransferFunctions2dLoader;

  constructor(host: PartHost) {
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

  histogram(channel: string): Histogram | null {
    return this.loader.histogram(channel);
  }

  retryFailed(): void {
    this.loader.retryFailed();
  }

  dispose(): void {}
}

export const channels: PartDefinition = {
  id: "channels",
  create: (host) => new ChannelsPart(host),
};
