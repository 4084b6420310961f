/** The card beside a tapped place, in HTML: a small dialog that does not block the view. */
import "./tap_card.css";
import { element, setText } from "../../dom/element";
import type { TapCardContent } from "../tap_card";
import { ignoreSecondClicks } from "./double_click";
import { Items } from "./panel";
import { type Point, placeBeside } from "./place_beside";
import type { Send } from "./widget";

export class TapCard {
  private readonly title = element("h2", { id: "tap-title" });
  private readonly subtitle = element("p", { className: "hint" });
  private readonly items: Items;
  private readonly mark = element("div", { className: "tap-mark" });
  private readonly card: HTMLElement;
  /** The part of the view in which the card may lie. */
  private readonly area: HTMLElement;
  private readonly closed = new AbortController();
  private place: Point = { x: 0, y: 0 };
  /** The element that had the focus before the card. */
  private returnTo: HTMLElement | null = null;

  /** @param view the part of the page with the canvas */
  constructor(
    view: HTMLElement,
    send: Send,
    private readonly onClose: () => void,
  ) {
    this.items = new Items(element("div", { className: "tap-items" }), send);
    const close = element(
      "button",
      { type: "button", className: "tap-close", textContent: "×", ariaLabel: "Close this card" },
      { control: "tap-close" },
    );
    close.addEventListener("click", () => this.onClose());
    this.card = element(
      "div",
      { className: "tap-card", role: "dialog", tabIndex: -1 },
      { tapCard: "" },
      element("header", {}, {}, element("div", {}, {}, this.title, this.subtitle), close),
      this.items.root,
    );
    this.card.setAttribute("aria-labelledby", this.title.id);
    this.area = element("div", { className: "tap-area", hidden: true }, {}, this.mark, this.card);
    ignoreSecondClicks(this.card);
    // the card follows the canvas, so that Tab leads from there into the card
    view.querySelector(".stage")?.after(this.area);
    const { signal } = this.closed;
    addEventListener("keydown", (event) => this.leaveByEscape(event), { capture: true, signal });
  }

  get isOpen(): boolean {
    return !this.area.hidden;
  }

  /** @param takesFocus whether the card was opened by a key */
  open(content: TapCardContent, place: Point, takesFocus: boolean): void {
    this.area.hidden = false;
    this.update(content);
    this.moveTo(place);
    if (!takesFocus) return;
    const { activeElement } = document;
    const isOutside = activeElement instanceof HTMLElement && !this.card.contains(activeElement);
    this.returnTo = isOutside ? activeElement : this.returnTo;
    this.card.querySelector<HTMLElement>(".tap-items button")?.focus();
  }

  update({ title, subtitle, controls }: TapCardContent): void {
    if (!this.isOpen) return;
    setText(this.title, title);
    setText(this.subtitle, subtitle);
    this.subtitle.hidden = subtitle === "";
    this.items.update(controls);
    this.lay();
  }

  /** Moves the tapped place, px of the view, and the card with it. */
  moveTo({ x, y }: Point): void {
    if (Math.hypot(x - this.place.x, y - this.place.y) < 0.1) return;
    this.place = { x, y };
    this.lay();
  }

  private lay(): void {
    const { place, card, mark, area } = this;
    const [width, height] = [area.clientWidth, area.clientHeight];
    // the area excludes the safe-area insets of the screen
    const within = { x: place.x - area.offsetLeft, y: place.y - area.offsetTop };
    mark.style.transform = `translate(${within.x}px, ${within.y}px)`;
    const size = { width: card.offsetWidth, height: card.offsetHeight };
    const { x, y } = placeBeside(within, size, { width, height });
    card.style.transform = `translate(${Math.round(x)}px, ${Math.round(y)}px)`;
  }

  close(): void {
    if (!this.isOpen) return;
    const hadFocus = this.card.contains(document.activeElement);
    this.area.hidden = true;
    if (hadFocus) this.returnTo?.focus();
    this.returnTo = null;
  }

  /** The first Escape closes the card and has no other effect. */
  private leaveByEscape(event: KeyboardEvent): void {
    if (event.key !== "Escape" || !this.isOpen || event.defaultPrevented) return;
    if (document.querySelector("dialog[open]") !== null) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    this.onClose();
  }

  dispose(): void {
    this.closed.abort();
    this.area.remove();
  }
}
