/** The view shared with a notebook, or with the page that holds this one in a frame. Its code loads where one does. */
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

  /** The way to who holds this page; null: nobody does, or wants to share its view. */
  private async findPort(): Promise<Port | null> {
    const port = globalThis.stereocellHost?.port;
    if (port !== undefined) return port;
    const { search } = new URL(pageAddress());
    const isEmbedded = window.parent !== window && new URLSearchParams(search).has("embed");
    if (!isEmbedded) return null;
    const { portToHolder } = await import("./frame_port");
    return portToHolder(search, this.host.bundle.manifest);
  }

  hearTap(tap: Tap): void {
    this.view?.hearTap(tap);
  }

  dispose(): void {
    this.view?.dispose();
  }
}

export const notebook: PartDefinition = {
  id: "notebook",
  create: (host) => new NotebookPart(host),
};
