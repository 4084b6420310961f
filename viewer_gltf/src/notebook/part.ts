/** The part of the viewer that shares the view with a notebook or a surrounding page. Its code loads only for those. */
import { pageAddress } from "../bundle/address";
import type { Part, PartDefinition, PartHost, Tap } from "../host/part";
import type { Port, ViewSharing } from "./view_sharing";

class NotebookPart implements Part {
  readonly id = "notebook";
  private view: ViewSharing | null = null;

  constructor(private readonly host: PartHost) {}

  async afterOpening(): Promise<void> {
    const port = await this.findPort();
    const links = this.host.service("links");
    if (port === null || links === null) return;
    const [{ ViewSharing }, code] = await Promise.all([import("./view_sharing"), links.load()]);
    this.view = new ViewSharing(this.host, port, code);
  }

  /** Returns a port to the notebook or page that contains this page; null if there is none, or if it shares no view. */
  private async findPort(): Promise<Port | null> {
    const port = globalThis.stereocellHost?.port;
    if (port !== undefined) return port;
    const { search } = new URL(pageAddress());
    const isEmbedded = window.parent !== window && new URLSearchParams(search).has("embed");
    if (!isEmbedded) return null;
    const { portToHolder } = await import("./frame_port");
    return portToHolder(search, this.host.bundle.manifest);
  }

  onTap(tap: Tap): void {
    this.view?.onTap(tap);
  }

  dispose(): void {
    this.view?.dispose();
  }
}

export const notebook: PartDefinition = {
  id: "notebook",
  create: (host) => new NotebookPart(host),
};
