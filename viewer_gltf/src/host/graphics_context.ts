/** Handles a graphics context that the driver drops and restores. */
import type { Action } from "../state/actions";
import { DROPPED } from "./faults";

/** An owner of GPU objects: `forget` drops those of a lost context, `renew` makes them again. */
type GpuOwner = Readonly<{ forget: () => void; renew: () => void }>;

/** Drops the objects of a lost context, and shows a notice until it is restored. */
export function watchContext(
  canvas: HTMLCanvasElement,
  owner: GpuOwner,
  dispatch: (action: Action) => void,
): void {
  canvas.addEventListener("webglcontextlost", () => {
    dispatch({ type: "notify", text: DROPPED });
    owner.forget();
  });
  canvas.addEventListener("webglcontextrestored", () => {
    owner.renew();
    dispatch({ type: "dismiss", texts: [DROPPED] });
  });
}
