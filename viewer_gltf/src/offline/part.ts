/** The part of the viewer for visits without a network. Its code loads after the first frame. */
import { isHeld } from "../bundle/held_files";
import type { Part, PartDefinition, PartHost } from "../host/part";

class OfflinePart implements Part {
  readonly id = "offline";

  constructor(private readonly host: PartHost) {}

  async afterOverview(): Promise<void> {
    const { bundle } = this.host;
    // Nothing is kept of a source that is still being built, or of a bundle that the page itself
    // has made.
    if (bundle.live !== undefined || isHeld(bundle.base)) return;
    const { KeepOffline } = await import("./keep_offline");
    await KeepOffline.start(this.host);
  }

  dispose(): void {}
}

export const offline: PartDefinition = {
  id: "offline",
  create: (host) => new OfflinePart(host),
};
