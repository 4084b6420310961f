/** Messages over the picture say why it is empty, or why a request was refused. Each offers a way back. */
import type { Box } from "../math/box";
import type { Offer } from "../panel/controls";
import { type Content, emptyViewOf } from "../panel/empty_view";
import { type Message, ViewMessage } from "../panel/html/view_message";
import { offerFor } from "../panel/ways_on";
import type { ViewerState } from "../state/viewer_state";
import type { Viewer } from "./viewer";

export class ViewMessagePart {
  private readonly message: ViewMessage;
  /** Channels whose list of volumes was asked for. */
  private readonly asked = new Set<string>();
  private readonly known = new Set<string>();

  constructor(
    private readonly viewer: Viewer,
    view: HTMLElement,
    private readonly opening: ViewerState,
    private readonly onKnown: () => void,
  ) {
    this.message = new ViewMessage(view);
  }

  /** Brings the message to the present state and to the files that have arrived. */
  update(): void {
    const { viewer } = this;
    const { state, contents } = viewer;
    if (contents.isLoading) return;
    const isElsewhere = viewer.stereo.kind !== null || contents.slices.standing !== null;
    const empty = isElsewhere ? null : emptyViewOf(state, this.content);
    this.message.show(empty && { text: empty.text, ...this.buttonOf(empty.offer) });
  }

  /** The button that leads on from a refusal; null: nothing does. */
  buttonFor(refusal: string, shown: Box): Omit<Message, "text"> | null {
    const { state, contents } = this.viewer;
    const offer = offerFor(refusal, { state, shown, objects: contents.objects.rowsShown });
    return offer && this.buttonOf(offer);
  }

  private buttonOf({ label, to }: Offer): Omit<Message, "text"> {
    const act = () => {
      // one step for all: undoing leads back to before the first
      to.forEach((each, i) => {
        if (typeof each === "string") this.viewer.run(each);
        else this.viewer.dispatch(each, i === 0);
      });
    };
    return { label, act };
  }

  private get content(): Content {
    const { opening, viewer } = this;
    const { surfaces, volumes, objects } = viewer.contents;
    return {
      opening,
      tiles: viewer.bundle.manifest.tiles,
      outline: ({ id, hasSurface, volume }) =>
        hasSurface ? surfaces.outline(id) : volume ? volumes.outline(id) : null,
      hasSurface: (channel, tile) => surfaces.of(channel).some((each) => each.tile === tile),
      hasVolume: (channel, tile) => {
        this.ask(channel);
        return this.known.has(channel) ? volumes.source(tile, channel) !== null : null;
      },
      objectsLeft: (channel) => objects.left(channel),
    };
  }

  /** Ask which tiles have volumes of a channel; surfaces alone do not need to know. */
  private ask(channel: string): void {
    if (this.asked.has(channel)) return;
    this.asked.add(channel);
    void this.viewer.contents.volumes.sourcesOf(channel).then((sources) => {
      if (sources === null) return;
      this.known.add(channel);
      this.onKnown();
    });
  }

  dispose(): void {
    this.message.dispose();
  }
}
