/**
 * Measures the size of this screen with a bank card on it, because no browser reports the size. All
 * such cards are equally large (ISO/IEC 7810 ID-1), and their short edge fits an upright phone.
 */
import { element } from "../../dom/element";
import { PER_INCH } from "../../state/stereo";

/** Short edge of a card, inches: 53.98 mm. */
const CARD_IN = 53.98 / 25.4;
/** Ratio of the long to the short edge. */
const LONG = 85.6 / 53.98;

/** Returns the CSS pixels per inch of a screen on which the short edge of a card has a width. */
export function perInchOf(card_px: number): number {
  return Number((card_px / CARD_IN).toFixed(1));
}

export function cardWidth(perInch: number): number {
  return Math.round(perInch * CARD_IN);
}

export class CardMeasure {
  private readonly frame = element("div", { className: "card-frame" });
  private readonly slider = element("input", {
    type: "range",
    min: String(cardWidth(PER_INCH[0])),
    max: String(cardWidth(PER_INCH[1])),
    ariaLabel: "Width of the frame",
    oninput: () => this.fit(),
  });
  private readonly cancel = element(
    "button",
    { type: "button", textContent: "Cancel", onclick: () => this.close() },
    { answer: "cancel" },
  );
  private readonly fits = element(
    "button",
    { type: "button", className: "primary", textContent: "It fits", onclick: () => this.keep() },
    { answer: "keep" },
  );
  readonly root = element(
    "dialog",
    { className: "card-measure" },
    { card: "" },
    element("p", {
      textContent:
        "Hold a bank card upright against the screen, and move the slider until the frame is as wide as the card.",
    }),
    this.frame,
    this.slider,
    element("div", { className: "card-answers" }, {}, this.cancel, this.fits),
  );

  constructor(
    parent: HTMLElement,
    private readonly onMeasured: (perInch: number) => void,
  ) {
    parent.append(this.root);
  }

  /** @param perInch first guess of the pixels per inch */
  open(perInch: number): void {
    this.slider.value = String(cardWidth(perInch));
    this.fit();
    this.root.showModal();
  }

  private fit(): void {
    const width_px = Number(this.slider.value);
    this.frame.style.width = `${width_px}px`;
    this.frame.style.height = `${Math.round(LONG * width_px)}px`;
  }

  private close(): void {
    this.root.close();
  }

  private keep(): void {
    this.close();
    this.onMeasured(perInchOf(Number(this.slider.value)));
  }

  dispose(): void {
    this.root.remove();
  }
}
