/** Handles under a mouse or a finger: they are dragged, and the camera stays where it is. */
import { Vector2 } from "three";
import type { HandleId, Pointing } from "../marks/clip_handles";

export type HandleTarget = Readonly<{
  /** Place in -1..1 of the picture, y up. */
  pick: (point: Vector2, pointing: Pointing) => HandleId | null;
  drag: (id: HandleId, point: Vector2) => void;
  /** The handle that is pointed at or held. */
  highlight: (id: HandleId | null) => void;
}>;

/**
 * Listens on the canvas's parent before the canvas itself hears of it, so that neither the camera
 * nor a click sees a drag that is the handle's.
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
      event.stopPropagation(); // a second finger is no pinch now
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
