/** A visit without a network, as a part of the viewer. Its code loads after the first picture. */
import type { Part, PartDefinition, PartHost } from "../host/part";

class OfflinePart implements Part {
  readonly id = "offline";

  constructor(private readonly host: PartHost) {}

  async afterOverview(): Promise<void> {
    if (this.host.bundle.live !== undefined) return; // the bundle is not whole yet
    const { KeepOffline } = await import("./keep_offline");
    await KeepOffline.start(this.host);
  }

  dispose(): void {}
}

export const offline: PartDefinition = {
  id: "offline",
  create: (host) => new OfflinePart(host),
};
