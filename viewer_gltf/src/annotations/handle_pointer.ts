/** Drags handles with a mouse or a finger, without moving the camera. */
import { Vector2 } from "three";
import type { HandleId, Pointing } from "../marks/clip_handles";

export type HandleTarget = Readonly<{
  /** `point` is in -1..1 of the frame, y up. */
  pick: (point: Vector2, pointing: Pointing) => HandleId | null;
  drag: (id: HandleId, point: Vector2) => void;
  /** Highlights the handle that is pointed at or held; null: none. */
  highlight: (id: HandleId | null) => void;
}>;

/**
 * Listens on the parent of the canvas during the capture phase, before the canvas receives an event. The drag of a
 * handle therefore reaches neither the camera nor the listener for clicks.
 */
export function listenForHandles(
  stage: HTMLElement,
  canvas: HTMLCanvasElement,
  { pick, drag, highlight }: HandleTarget,
  signal: AbortSignal,
): void {
  let held: { id: HandleId; pointer: number } | null = null;
  const pointAt = ({ clientX, clientY }: PointerEvent) => {
    const box = canvas.getBoundingClientRect();
    const x = ((clientX - box.left) / box.width) * 2 - 1;
    return new Vector2(x, 1 - ((clientY - box.top) / box.height) * 2);
  };
  const pointingOf = (event: PointerEvent) => (event.pointerType === "touch" ? "touch" : "mouse");
  const listen = (
    type: "pointerdown" | "pointermove" | "pointerup" | "pointercancel",
    handle: (event: PointerEvent) => void,
  ) =>
    stage.addEventListener(
      type,
      (event) => {
        if (event.target === canvas) handle(event);
      },
      { capture: true, signal },
    );
  const end = (event: PointerEvent) => {
    if (held === null) return;
    event.stopPropagation();
    if (event.pointerId !== held.pointer) return;
    held = null;
    highlight(null);
  };

  listen("pointerdown", (event) => {
    if (held !== null) {
      event.stopPropagation(); // a second finger must not start a pinch while a handle is held
      return;
    }
    if (event.button !== 0) return;
    const id = pick(pointAt(event), pointingOf(event));
    if (id === null) return;
    event.stopPropagation();
    canvas.setPointerCapture(event.pointerId);
    held = { id, pointer: event.pointerId };
    highlight(id);
  });
  listen("pointermove", (event) => {
    if (held === null) {
      if (event.buttons === 0) highlight(pick(pointAt(event), pointingOf(event)));
      return;
    }
    event.stopPropagation();
    if (event.pointerId === held.pointer) drag(held.id, pointAt(event));
  });
  listen("pointerup", end);
  listen("pointercancel", end);
}
