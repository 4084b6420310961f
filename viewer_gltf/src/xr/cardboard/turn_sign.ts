/**
 * The sign that covers an upright phone: the phone must be turned on its side before the screen is
 * split.
 */
import { element } from "../../dom/element";

const SVG = "http://www.w3.org/2000/svg";
const WORDS = "Turn the phone on its side";
const MORE = "If the image stays upright, switch off the phone's rotation lock.";
/** Icon: an upright phone, a phone on its side, and an arrow from the first to the second. */
const SHAPES: readonly (readonly [name: string, attributes: Readonly<Record<string, string>>])[] = [
  ["rect", { x: "16", y: "14", width: "36", height: "68", rx: "6", opacity: "0.45" }],
  ["rect", { x: "62", y: "62", width: "68", height: "36", rx: "6" }],
  ["path", { d: "M62 30 A42 42 0 0 1 98 50" }],
  ["path", { d: "M88 45 L98 52 L103 41" }],
];
const COVER = {
  position: "absolute",
  inset: "0",
  zIndex: "1",
  display: "grid",
  placeContent: "center",
  justifyItems: "center",
  gap: "1.2rem",
  padding: "1.5rem",
  background: "#0b0d12",
  color: "#e6e9f0",
  font: "500 1.3rem/1.4 system-ui, sans-serif",
  textAlign: "center",
};
const BUTTON = {
  font: "inherit",
  color: "inherit",
  minHeight: "3rem",
  padding: "0.4rem 1.4rem",
  background: "#242b39",
  border: "1px solid #3a4458",
  borderRadius: "0.6rem",
};

const upright = () => matchMedia("(orientation: portrait)");

export class TurnSign {
  private readonly root = element("div", { role: "status" });
  private readonly stopped = new AbortController();

  constructor(stage: HTMLElement, onLeave: () => void) {
    const words = element("div", {}, {}, WORDS);
    const more = element("div", {}, {}, MORE);
    const leave = element("button", { type: "button" }, {}, "Leave stereo");
    more.style.fontSize = "1rem";
    Object.assign(this.root.style, COVER);
    Object.assign(leave.style, BUTTON);
    this.root.append(image(), words, more, leave);
    const { signal } = this.stopped;
    leave.addEventListener("click", onLeave, { signal });
    upright().addEventListener("change", () => this.update(), { signal });
    stage.append(this.root);
    this.update();
  }

  /** Resolves when the phone lies on its side or the sign is removed. */
  turned(): Promise<void> {
    return new Promise((resolve) => {
      const { signal } = this.stopped;
      const check = () => (signal.aborted || !upright().matches) && resolve();
      upright().addEventListener("change", check, { signal });
      signal.addEventListener("abort", check);
      check();
    });
  }

  private update(): void {
    this.root.style.display = upright().matches ? COVER.display : "none";
  }

  dispose(): void {
    this.stopped.abort();
    this.root.remove();
  }
}

function image(): SVGElement {
  const svg = document.createElementNS(SVG, "svg");
  const frame = { viewBox: "0 0 146 112", width: "180", "aria-hidden": "true", fill: "none" };
  const line = { stroke: "#5aa9ff", "stroke-width": "4", "stroke-linecap": "round" };
  setAll(svg, { ...frame, ...line, "stroke-linejoin": "round" });
  for (const [name, attributes] of SHAPES) {
    const shape = document.createElementNS(SVG, name);
    setAll(shape, attributes);
    svg.append(shape);
  }
  return svg;
}

function setAll(element: Element, attributes: Readonly<Record<string, string>>): void {
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
}
