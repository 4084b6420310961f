/**
 * Messages over the view that report why it is empty, or why a request was refused. Each offers a
 * button that solves the problem.
 */
import type { PartHost } from "../host/part";
import type { Offer } from "../panel/controls";
import { type Content, emptyViewOf } from "../panel/empty_view";
import { type Message, ViewMessage } from "../panel/html/view_message";
import { offerFor } from "../panel/remedies";
import type { ViewerState } from "../state/viewer_state";

export class PictureMessage {
  private readonly message: ViewMessage;
  /** Channels whose lists of volumes have been requested. */
  private readonly requested = new Set<string>();
  private readonly known = new Set<string>();

  constructor(
    private readonly host: PartHost,
    private readonly opening: ViewerState,
  ) {
    this.message = new ViewMessage(host.view);
  }

  /** Updates the message to the present state and to the files that have arrived. */
  update(): void {
    const { state, display, isInStereo, hasStandingPart } = this.host;
    if (display.isLoading) return;
    const empty = isInStereo || hasStandingPart ? null : emptyViewOf(state, this.content);
    this.message.show(empty && { text: empty.text, ...this.buttonOf(empty.offer) });
  }

  /** Returns the button that solves a refusal; null: none. */
  buttonFor(refusal: string): Omit<Message, "text"> | null {
    const { host } = this;
    const objects = host.service("objects")?.rowsShown ?? new Map();
    const now = { state: host.state, shown: host.panel.shown, objects };
    const offer = offerFor(refusal, now, host.remedies);
    return offer && this.buttonOf(offer);
  }

  private buttonOf({ label, to }: Offer): Omit<Message, "text"> {
    const act = () => {
      // undo takes all actions of the button back as one step
      to.forEach((each, i) => {
        if (typeof each === "string") this.host.run(each);
        else this.host.dispatch(each, i === 0);
      });
    };
    return { label, act };
  }

  private get content(): Content {
    const { opening, host } = this;
    const surfaces = host.service("surfaces");
    const volumes = host.service("volumes");
    return {
      opening,
      tiles: host.bundle.manifest.tiles,
      outline: ({ id, hasSurface, volume }) =>
        (hasSurface ? surfaces?.outline(id) : volume ? volumes?.outline(id) : null) ?? null,
      hasSurface: (channel, tile) =>
        surfaces?.of(channel).some((each) => each.tile === tile) ?? false,
      hasVolume: (channel, tile) => {
        this.requestList(channel);
        return this.known.has(channel) ? volumes?.source(tile, channel) != null : null;
      },
      shownObjectCount: (channel) => host.service("objects")?.shownCount(channel) ?? null,
    };
  }

  /** Requests the list of a channel's volumes, which surfaces do not need. */
  private requestList(channel: string): void {
    if (this.requested.has(channel)) return;
    this.requested.add(channel);
    void this.host
      .service("volumes")
      ?.sourcesOf(channel)
      .then((sources) => {
        if (sources === null) return;
        this.known.add(channel);
        this.update();
      });
  }

  dispose(): void {
    this.message.dispose();
  }
}
