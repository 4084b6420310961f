/** The link to the view as a part of the viewer: in the clipboard, in the address bar and in the panel. */
import { hasAddress, pageAddress } from "../bundle/address";
import { copyText } from "../dom/clipboard";
import { NOT_LOADED } from "../host/later";
import type { Part, PartDefinition, PartHost } from "../host/part";
import { initialState } from "../state/initial_state";
import { isPassingStep, writeAddress } from "./address";
import { SETTINGS } from "./page_parameters";

type LinkCode = typeof import("./link_of");

class SharePart implements Part {
  readonly id = "share";
  readonly commands = { share: () => void this.share() };

  /** The code that writes links; null until a link is first wanted. */
  private code: LinkCode | null = null;

  constructor(private readonly host: PartHost) {}

  private async share(): Promise<void> {
    if (this.code === null) this.code = await import("./link_of").catch(() => null);
    if (this.code === null) this.host.announce(NOT_LOADED);
    else await this.shareBy(this.code);
  }

  private async shareBy({ leftOutOfLink, linkOf }: LinkCode): Promise<void> {
    const { host } = this;
    const address = new URL(pageAddress());
    for (const name of SETTINGS) address.searchParams.delete(name);
    address.hash = linkOf(host, initialState(host.bundle.manifest));
    // the address follows the view once the split screen is left
    if (hasAddress() && !isPassingStep()) writeAddress(address);
    host.panel.show({ link: address.href });
    host.panel.unfold("share");
    host.stereo.showInPanel({ link: address.href });
    const without = leftOutOfLink(host);
    const but =
      without === 0
        ? ""
        : ` It leaves out lists of ${without} objects, which are too long: save them as CSV.`;
    if (host.isInRoom) {
      host.announce(`The link is in the page's address, for when you leave.${but}`);
    } else if (await copyText(address.href)) {
      host.announce(`The link is in the clipboard.${but}`);
    } else {
      host.service("page")?.focus("share", "link"); // which selects it
      host.announce(`Here is the link, selected: copy it by Ctrl+C, or by a long press.${but}`);
    }
  }

  dispose(): void {}
}

export const share: PartDefinition = {
  id: "share",
  create: (host) => new SharePart(host),
};
