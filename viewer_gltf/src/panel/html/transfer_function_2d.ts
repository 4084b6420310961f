/**
 * The joint histogram with shapes that the mouse or a finger drags. When it has the focus, the
 * arrow keys move the selected shape.
 */

import { element, setText } from "../../dom/element";
import type { HistogramPoint } from "../../state/transfer_shapes";
import type { Mark, Rect } from "../canvas/draw_list";
import { paint } from "../canvas/paint";
import { histogramMarks } from "../canvas/transfer_function_2d";
import type { HistogramEditor } from "../controls";
import { shapeText } from "../edit_shapes";
import { hooks, type Send, type Widget } from "./widget";

/** Width of the canvas, px; the page scales it. */
const WIDTH = 640;
const HEIGHT = 320;
const HANDLE = 22;
/** Space around the histogram, px of the canvas, for the half of a handle beyond its edge. */
const PAD = 14;
const PLANE: Rect = { x: PAD, y: PAD, width: WIDTH - 2 * PAD, height: HEIGHT - 2 * PAD };
/** Largest distance from a corner or an edge at which a pointer grabs it, px of the page. */
const MOUSE_REACH = 8;
const FINGER_REACH = 22;
/** One step of an arrow key, as a share of the histogram. */
const ARROWS: Readonly<Record<string, HistogramPoint>> = {
  ArrowLeft: { value: -2 / 255, gradient: 0 },
  ArrowRight: { value: 2 / 255, gradient: 0 },
  ArrowUp: { value: 0, gradient: 1.01 / 63 },
  ArrowDown: { value: 0, gradient: -1.01 / 63 },
};

export function makeHistogram(first: HistogramEditor, send: Send): Widget<HistogramEditor> {
  let now = first;
  let painted = "";
  const canvas = element("canvas", { width: WIDTH, height: HEIGHT, tabIndex: 0 }, hooks(first.id));
  canvas.setAttribute("role", "application");
  const context = canvas.getContext("2d");
  const pointOf = ({ clientX, clientY }: MouseEvent): HistogramPoint => {
    const { left, top, width, height } = canvas.getBoundingClientRect();
    const inside = (x: number) => Math.min(1, Math.max(0, x));
    const x = ((clientX - left) / width) * WIDTH;
    const y = ((clientY - top) / height) * HEIGHT;
    return {
      value: inside((x - PLANE.x) / PLANE.width),
      gradient: inside(1 - (y - PLANE.y) / PLANE.height),
    };
  };
  const drag = (at: HistogramPoint) => {
    const request = now.refusal ? null : now.drag(at);
    if (request !== null) send(request);
  };
  canvas.addEventListener("pointerdown", (event) => {
    if (now.refusal || !event.isPrimary || event.button !== 0) return;
    const { width, height } = canvas.getBoundingClientRect();
    const px = event.pointerType === "mouse" ? MOUSE_REACH : FINGER_REACH;
    canvas.setPointerCapture(event.pointerId);
    send(now.press(pointOf(event), { value: px / width, gradient: px / height }));
  });
  canvas.addEventListener("pointermove", (event) => {
    if (canvas.hasPointerCapture(event.pointerId)) drag(pointOf(event));
  });
  canvas.addEventListener("keydown", (event) => {
    const by = ARROWS[event.key];
    const shape = now.selected === null ? undefined : now.shapes[now.selected];
    if (by === undefined || shape === undefined || now.refusal) return;
    event.preventDefault();
    const index = now.selected ?? 0;
    const from = { value: 0.5, gradient: 0.5 };
    const selected = { index, count: now.shapes.length };
    send({ panel: "shape", shape: selected, grab: { index, part: "body", from, shape } });
    drag({ value: from.value + by.value, gradient: from.gradient + by.gradient });
  });
  const low = element("span");
  const high = element("span");
  const steepest = element("span", { className: "steepest" });
  const axis = element("span", { className: "axis" }, {}, low, high);
  const root = element("div", { className: "plane" }, {}, canvas, steepest, axis);
  return {
    root,
    update(control) {
      now = control;
      const shape = control.selected === null ? undefined : control.shapes[control.selected];
      const content =
        shape === undefined ? "no shape" : `${control.shapes.length} shapes, ${shapeText(shape)}`;
      canvas.ariaLabel = `${control.name ?? control.label}: ${control.refusal || content}`;
      canvas.ariaDisabled = control.refusal ? "true" : null;
      setText(low, control.texts[0]);
      setText(high, control.texts[1]);
      setText(steepest, control.texts[2]);
      const marks: readonly Mark[] = histogramMarks(control, PLANE, HANDLE);
      const text = JSON.stringify(marks);
      if (context === null || text === painted) return;
      painted = text;
      context.clearRect(0, 0, WIDTH, HEIGHT);
      paint(context, marks);
    },
  };
}
