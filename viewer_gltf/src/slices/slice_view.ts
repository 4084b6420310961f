/**
 * The slices as images in the page, with a crosshair, the sides, and the values under the pointer. A drag moves the
 * crosshair, and the wheel moves the slice along its normal. A drag with Shift rotates the other two slices about
 * this one's normal. A drag with the right button changes the window: to the right widens it, up brightens the image.
 * The arrow keys, Page Up, Page Down and Shift with an arrow key do the same.
 */
import { element, setText } from "../dom/element";
import type { Vec3 } from "../math/vec3";
import { placeIn, pointIn, type SliceFrame } from "./slice_frame";
import type { SliceImages } from "./slice_images";

export type SliceChanges = Readonly<{
  move: (point: Vec3) => void;
  turn: (about: Vec3, by_deg: number) => void;
  /** `wider` widens the window, and `higher` lowers its limits, which brightens; both are shares of all intensities. */
  window: (wider: number, higher: number) => void;
}>;

/**
 * Movement of the crosshair or the slice for each press of a key, as a share of the image's edge.
 */
const KEY_STEP = 0.01;
const KEY_TURN_DEG = 5;
const WHEEL_STEP = 0.01;
const EDGES = ["left", "right", "top", "bottom"] as const;

/** One slice in the page: its image with the texts around it. */
class SliceFigure {
  readonly root: HTMLElement;
  private readonly plane: HTMLElement;
  private readonly across = element("i", { className: "line across" });
  private readonly down = element("i", { className: "line down" });
  private readonly letters = EDGES.map((edge) => element("b", { className: `end ${edge}` }));
  private readonly name = element("figcaption");
  private readonly values = element("p", { className: "values" });
  private frame: SliceFrame | null = null;
  /** The point under the pointer, um; null: the pointer is elsewhere. */
  private pointed: Vec3 | null = null;
  /** Whether a request for the measured values is under way. */
  private isAsking = false;
  /** The text of the values that is shown now. */
  private written = "";

  constructor(
    index: number,
    private readonly images: SliceImages,
    private readonly changes: SliceChanges,
    onEnlarge: () => void,
  ) {
    const canvas = images.canvases[index];
    this.plane = element(
      "div",
      { className: "plane", tabIndex: 0, role: "application" },
      { slice: String(index) },
      canvas,
      this.across,
      this.down,
      ...this.letters,
    );
    const enlarge = element("button", {
      type: "button",
      className: "enlarge",
      textContent: "⤢",
      ariaLabel: "Show only this slice, or all three",
      title: "Show only this slice, or all three",
      onclick: onEnlarge,
    });
    this.root = element("figure", {}, {}, this.plane, this.name, this.values, enlarge);
    this.listen();
  }

  update(frame: SliceFrame): void {
    this.frame = frame;
    const { x, y } = placeIn(frame, this.images.point);
    this.plane.style.setProperty("--ratio", (frame.half[0] / frame.half[1]).toFixed(4));
    this.down.style.left = `${(100 * x).toFixed(3)}%`;
    this.across.style.top = `${(100 * y).toFixed(3)}%`;
    this.letters.forEach((letter, i) => {
      setText(letter, frame.ends[i]);
    });
    setText(this.name, frame.name);
    this.showValues();
  }

  /** Shows the values of 8 bits at once, and the measured values when they arrive for the newest position. */
  private showValues(): void {
    this.writeValues();
    const at = this.place;
    const answer = this.isAsking ? null : this.images.measureAt(at);
    if (answer === null) return;
    this.isAsking = true;
    void answer.then(() => {
      this.isAsking = false;
      if (at.join() === this.place.join()) this.writeValues();
      else this.showValues();
    });
  }

  private get place(): Vec3 {
    return this.pointed ?? this.images.point;
  }

  private writeValues(): void {
    const at = this.place;
    const values = this.images.valuesAt(at);
    const text = values.length > 0 || this.images.hasLoaded ? values.join(" · ") : "loading …";
    if (text !== this.written) {
      // one span for each channel, so that no line breaks between a value and its name
      const parts = values.length > 0 ? values : [text];
      this.values.replaceChildren(...parts.map((textContent) => element("span", { textContent })));
    }
    this.written = text;
    const [left, right, top, bottom] = this.frame?.ends ?? [];
    this.plane.ariaLabel =
      `Slice ${this.frame?.name}: ${left} on the left, ${right} on the right, ${top} at the top, ` +
      `${bottom} at the bottom. ${text}`;
  }

  private placeOf({ clientX, clientY }: MouseEvent) {
    const { left, top, width, height } = this.plane.getBoundingClientRect();
    const within = (v: number) => Math.min(1, Math.max(0, v));
    return { x: within((clientX - left) / width), y: within((clientY - top) / height) };
  }

  private listen(): void {
    const { plane, changes } = this;
    let last: MouseEvent | null = null;
    plane.addEventListener("contextmenu", (event) => event.preventDefault());
    plane.addEventListener("pointerdown", (event) => {
      plane.setPointerCapture(event.pointerId);
      last = event;
      if (event.button === 0 && !event.shiftKey && this.frame !== null) {
        changes.move(pointIn(this.frame, this.placeOf(event)));
      }
    });
    plane.addEventListener("pointermove", (event) => {
      if (this.frame === null) return;
      this.pointed = pointIn(this.frame, this.placeOf(event));
      if (last === null) this.showValues();
      else if (event.buttons & 2) {
        const { width, height } = plane.getBoundingClientRect();
        const [dx, dy] = [event.clientX - last.clientX, event.clientY - last.clientY];
        changes.window(dx / width, -dy / height);
      } else if (event.shiftKey) this.turnBy(last, event);
      else changes.move(this.pointed);
      if (last !== null) last = event;
    });
    const end = () => {
      last = null;
    };
    plane.addEventListener("pointerup", end);
    plane.addEventListener("pointercancel", end);
    plane.addEventListener("pointerleave", () => {
      this.pointed = null;
      if (this.frame !== null) this.showValues();
    });
    plane.addEventListener(
      "wheel",
      (event) => {
        event.preventDefault();
        this.moveThrough(Math.sign(event.deltaY) * WHEEL_STEP);
      },
      { passive: false },
    );
    plane.addEventListener("keydown", (event) => {
      if (this.byKey(event)) event.preventDefault();
    });
  }

  /** Rotates the other slices about the crosshair by the angle that the pointer has moved around it. */
  private turnBy(from: MouseEvent, to: MouseEvent): void {
    const { frame } = this;
    if (frame === null) return;
    const { left, top, width, height } = this.plane.getBoundingClientRect();
    const middle = placeIn(frame, this.images.point);
    const angle = ({ clientX, clientY }: MouseEvent) =>
      Math.atan2(top + middle.y * height - clientY, clientX - left - middle.x * width);
    const by = ((angle(to) - angle(from) + 3 * Math.PI) % (2 * Math.PI)) - Math.PI;
    this.changes.turn(frame.normal, (by * 180) / Math.PI);
  }

  /** Moves the slice along its normal, towards the eye, by a share of the image's longer edge. */
  private moveThrough(share: number): void {
    const { frame } = this;
    if (frame === null) return;
    this.shift(frame.normal, 2 * share * Math.max(...frame.half));
  }

  private shift(along: Vec3, by_um: number): void {
    const [x, y, z] = this.images.point;
    this.changes.move([x + by_um * along[0], y + by_um * along[1], z + by_um * along[2]]);
  }

  private byKey({ key, shiftKey }: KeyboardEvent): boolean {
    const { frame } = this;
    if (frame === null) return false;
    const turn = { ArrowLeft: 1, ArrowRight: -1, ArrowUp: 1, ArrowDown: -1 }[key];
    if (shiftKey && turn !== undefined) {
      this.changes.turn(frame.normal, turn * KEY_TURN_DEG);
      return true;
    }
    const [across, along] = frame.half.map((half) => 2 * KEY_STEP * half);
    if (key === "ArrowLeft") this.shift(frame.right, -across);
    else if (key === "ArrowRight") this.shift(frame.right, across);
    else if (key === "ArrowUp") this.shift(frame.up, along);
    else if (key === "ArrowDown") this.shift(frame.up, -along);
    else if (key === "PageUp") this.moveThrough(KEY_STEP);
    else if (key === "PageDown") this.moveThrough(-KEY_STEP);
    else return false;
    return true;
  }
}

export class SliceView {
  readonly root = element("div", { className: "slices", role: "group", ariaLabel: "Slices" });
  private readonly figures: readonly SliceFigure[];
  private large: number | null = null;

  /** @param view the part of the page with the stage, which shrinks while slices are shown */
  constructor(
    private readonly view: HTMLElement,
    private readonly images: SliceImages,
    changes: SliceChanges,
  ) {
    this.figures = images.canvases.map(
      (_, i) => new SliceFigure(i, images, changes, () => this.enlarge(i)),
    );
    this.root.append(...this.figures.map(({ root }) => root));
    this.root.hidden = true;
    view.append(this.root);
  }

  update(areShown: boolean): void {
    const { frames } = this.images;
    this.root.hidden = !areShown || frames === null;
    this.view.classList.toggle("with-slices", !this.root.hidden);
    if (this.root.hidden || frames === null) return;
    this.figures.forEach((figure, i) => {
      figure.update(frames[i]);
    });
  }

  private enlarge(index: number): void {
    this.large = this.large === index ? null : index;
    this.root.classList.toggle("alone", this.large !== null);
    this.figures.forEach(({ root }, i) => {
      root.hidden = this.large !== null && i !== this.large;
    });
  }

  dispose(): void {
    this.view.classList.remove("with-slices");
    this.root.remove();
  }
}
