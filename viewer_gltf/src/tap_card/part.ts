/**
 * A tap on the flat view opens a card beside the place. The code of the card is loaded with the
 * first tap.
 */

import { NOT_LOADED } from "../host/later";
import type { Part, PartDefinition, PartHost, Tap } from "../host/part";
import type { PlacedCard } from "./placed_card";

class TapCardPart implements Part {
  readonly id = "tap-card";
  private card: PlacedCard | null = null;
  /** Number of taps so far. If another tap comes while the code is loading, the first one opens no card. */
  private taps = 0;

  constructor(private readonly host: PartHost) {
    host.panel.onShown(() => this.card?.update());
    host.drawn.subscribe(() => this.card?.sync());
    host.doubleTapped.subscribe(() => {
      this.taps++;
      this.card?.close();
    });
  }

  openCard(tap: Tap): void {
    void this.open(tap);
  }

  private async open(tap: Tap): Promise<void> {
    const { host } = this;
    const number = ++this.taps;
    const part = await import("./placed_card").catch(() => null);
    if (number !== this.taps) return;
    if (part === null) {
      host.announce(NOT_LOADED);
      return;
    }
    this.card ??= new part.PlacedCard(host, (request) => host.service("page")?.perform(request));
    await this.card.open(tap);
  }

  dispose(): void {
    this.card?.dispose();
  }
}

export const tapCard: PartDefinition = {
  id: "tap-card",
  create: (host) => new TapCardPart(host),
};
