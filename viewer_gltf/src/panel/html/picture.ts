/**
 * A canvas in the panel whose content another part of the viewer draws. It reports the points of
 * presses and drags.
 */
import { element, setText } from "../../dom/element";
import type { Picture, Request } from "../controls";
import { withExplainer } from "./explain";
import { hooks, type Send, type Widget } from "./widget";

/** Width of the canvas, px; the page scales it. */
const WIDTH = 640;

export function makePicture(first: Picture, send: Send): Widget<Picture> {
  let now = first;
  let painted = "";
  const canvas = element("canvas", { width: WIDTH, role: "img" }, hooks(first.id));
  const context = canvas.getContext("2d");
  const at = (event: PointerEvent, to: (x: number, y: number) => Request | null) => {
    const { left, top, width, height } = canvas.getBoundingClientRect();
    const inside = (share: number) => Math.min(1, Math.max(0, share));
    const x = inside((event.clientX - left) / width);
    const request = to(x, inside((event.clientY - top) / height));
    if (request !== null) send(request);
  };
  canvas.addEventListener("pointerdown", (event) => {
    if (!event.isPrimary || event.button !== 0) return;
    canvas.setPointerCapture(event.pointerId);
    at(event, now.press);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (now.drag && canvas.hasPointerCapture(event.pointerId)) at(event, now.drag);
  });
  const label = element("span", { className: "label" });
  const root = element("div", { className: "plane picture" }, {}, label, canvas);
  return {
    root: first.about ? withExplainer(first, root) : root,
    update(control) {
      now = control;
      setText(label, control.label);
      canvas.ariaLabel = `${control.label}: ${control.text}`;
      const height = Math.round(WIDTH * control.height);
      const text = `${height} ${control.version}`;
      if (context === null || text === painted) return;
      painted = text;
      canvas.height = height; // setting the height also clears the canvas
      control.draw(context, WIDTH, height);
    },
  };
}
