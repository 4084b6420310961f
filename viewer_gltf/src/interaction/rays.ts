/** Rays into the specimen: from a click on the canvas, or from the head. */
import { Matrix4, type Object3D, type PerspectiveCamera, Vector2, Vector3 } from "three";
import type { Ray } from "../math/vec3";
import type { SceneRay } from "./ray_pointer";

/**
 * Milliseconds and pixels. Longest time and distance between the two clicks or taps of a double
 * click.
 */
const DOUBLE_MS = 400;
const DOUBLE_PX = 24;
/**
 * Pixels. Longest distance between down and up of a click or a tap; a pointer that moves further
 * orbits. A finger rolls as it taps.
 */
const CLICK_PX = 5;
const TAP_PX = 14;

/** The ray from `eye` through `towards` (scene) in the specimen's own space (um, world). */
function rayInto(specimen: Object3D, eye: Vector3, towards: Vector3): Ray {
  const toSpecimen = new Matrix4().copy(specimen.matrixWorld).invert();
  const origin = eye.applyMatrix4(toSpecimen);
  const direction = towards.applyMatrix4(toSpecimen).sub(origin);
  return { origin: origin.toArray(), direction: direction.toArray() };
}

/** The ray under a point of the image, given in -1 to 1 with y up. */
export function rayUnder(point: Vector2, camera: PerspectiveCamera, specimen: Object3D): Ray {
  camera.updateMatrixWorld();
  const towards = new Vector3(point.x, point.y, 0.5).unproject(camera);
  return rayInto(specimen, camera.position.clone(), towards);
}

/** The ray straight ahead of the head. `head` is the head's pose in the scene. */
export function rayAhead(head: Matrix4, specimen: Object3D): Ray {
  const eye = new Vector3().setFromMatrixPosition(head);
  return rayInto(specimen, eye, new Vector3(0, 0, -1).applyMatrix4(head));
}

/**
 * Converts a ray of the scene into the specimen's own space; its direction keeps a length of one
 * metre.
 */
export function rayAlong({ origin, direction }: SceneRay, toSpecimen: Matrix4): Ray {
  const from = origin.clone().applyMatrix4(toSpecimen);
  const to = origin.clone().add(direction).applyMatrix4(toSpecimen);
  return { origin: from.toArray(), direction: to.sub(from).toArray() };
}

/**
 * Calls `onClick` with the position, in -1 to 1 with y up, of every click or tap that does not
 * drag. Two fingers zoom and move, so they do not tap.
 *
 * @param onDouble called for the second of two quick clicks in one place, instead of `onClick`
 */
export function listenForClicks(
  canvas: HTMLCanvasElement,
  onClick: (point: Vector2) => void,
  onDouble: (point: Vector2) => void,
): void {
  const down = new Map<number, Vector2>();
  let isTap = false;
  let before: Readonly<{ at: Vector2; time_ms: number }> | null = null;
  canvas.addEventListener("pointerdown", (event) => {
    down.set(event.pointerId, new Vector2(event.clientX, event.clientY));
    isTap = down.size === 1;
  });
  canvas.addEventListener("pointercancel", (event) => down.delete(event.pointerId));
  canvas.addEventListener("pointerup", (event) => {
    const start = down.get(event.pointerId);
    down.delete(event.pointerId);
    if (start === undefined || !isTap || event.button !== 0) return;
    const most_px = event.pointerType === "touch" ? TAP_PX : CLICK_PX;
    if (start.distanceTo(new Vector2(event.clientX, event.clientY)) > most_px) return;
    const box = canvas.getBoundingClientRect();
    const x = ((event.clientX - box.left) / box.width) * 2 - 1;
    const y = 1 - ((event.clientY - box.top) / box.height) * 2;
    const at = new Vector2(event.clientX, event.clientY);
    const { timeStamp: time_ms } = event;
    const isSecond =
      before !== null &&
      time_ms - before.time_ms < DOUBLE_MS &&
      at.distanceTo(before.at) < DOUBLE_PX;
    before = isSecond ? null : { at, time_ms };
    (isSecond ? onDouble : onClick)(new Vector2(x, y));
  });
}
