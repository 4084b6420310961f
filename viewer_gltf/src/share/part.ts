/** A part of the viewer: puts the link to the view into the clipboard, the address bar and the panel. */
import { hasAddress, pageAddress } from "../bundle/address";
import { copyText } from "../dom/clipboard";
import { NOT_LOADED } from "../host/later";
import type { Part, PartDefinition, PartHost } from "../host/part";
import type { LinkCode, Links } from "../host/services";
import { initialState } from "../state/initial_state";
import { isPassingStep, writeAddress } from "./address";
import type { AddressBar, Opened } from "./address_bar";
import { settingNames } from "./page_parameters";

type LinkWriter = typeof import("./link_of");

class SharePart implements Part, Links {
  readonly id = "share";
  readonly services = { links: this };
  readonly commands = { share: () => void this.share() };

  /** The code that writes links; null until the first link is written. */
  private code: LinkWriter | null = null;
  /** The view that the address has opened; null until it is open. */
  private opened: Opened | null = null;
  /**
   * Keeps the page's address equal to a link to the view; null if the address does not follow the
   * view.
   */
  private addressBar: AddressBar | null = null;

  constructor(private readonly host: PartHost) {}

  afterOpening(): void {
    const { state, viewpoint } = this.host;
    this.opened = { state, camera: viewpoint.cameraView };
  }

  /** Lets the address follow the view from now on, unless that is turned off. */
  async afterOverview(): Promise<void> {
    const { opened } = this;
    if (opened === null || !hasAddress()) return;
    const { AddressBar, follows } = await import("./address_bar");
    const isFollowed = follows(location.search, window.parent !== window);
    if (isFollowed) this.addressBar = new AddressBar(this.host, opened);
  }

  writeAddress(): void {
    this.addressBar?.write();
  }

  async load(): Promise<LinkCode> {
    const { host } = this;
    const { manifest } = host.bundle;
    const [{ linkOf }, { readLink }] = await Promise.all([
      import("./link_of"),
      import("./permalink"),
    ]);
    return {
      link: () => linkOf(host, initialState(manifest)),
      read: (link, state) => readLink(link, state, manifest.specimen.bounds_um),
    };
  }

  private async share(): Promise<void> {
    if (this.code === null) this.code = await import("./link_of").catch(() => null);
    if (this.code === null) this.host.announce(NOT_LOADED);
    else await this.shareBy(this.code);
  }

  private async shareBy({ leftOutOfLink, linkOf }: LinkWriter): Promise<void> {
    const { host } = this;
    const address = new URL(pageAddress());
    for (const name of settingNames()) address.searchParams.delete(name);
    address.hash = linkOf(host, initialState(host.bundle.manifest));
    // In the split screen the address is not changed. Afterwards it follows the view again.
    if (hasAddress() && !isPassingStep()) writeAddress(address);
    host.panel.show({ link: address.href });
    host.panel.unfold("share");
    host.stereo.showInPanel({ link: address.href });
    const without = leftOutOfLink(host);
    const but =
      without === 0
        ? ""
        : ` The link leaves out ${without} objects, because their lists are too long. Save them as CSV.`;
    if (host.isInStereo) {
      host.announce(`The link is in the page's address. Copy it after you leave stereo.${but}`);
    } else if (await copyText(address.href)) {
      host.announce(`The link is in the clipboard.${but}`);
    } else {
      host.service("page")?.focus("share", "link"); // focusing the field selects the link
      host.announce(
        `The link is selected in the panel. Copy it with Ctrl+C or a long press.${but}`,
      );
    }
  }

  dispose(): void {
    this.addressBar?.dispose();
  }
}

export const share: PartDefinition = {
  id: "share",
  create: (host) => new SharePart(host),
};
