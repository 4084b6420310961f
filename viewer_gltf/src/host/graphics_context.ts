/** A graphics context that the driver drops, and gives back. */
import type { Action } from "../state/actions";
import { DROPPED } from "./faults";

/** An owner of textures and buffers: `forget` drops those of a lost context, `renew` makes them again. */
type Holder = Readonly<{ forget: () => void; renew: () => void }>;

/** Forgets what a lost context held, and says so as long as it is lost. */
export function watchContext(
  canvas: HTMLCanvasElement,
  holder: Holder,
  dispatch: (action: Action) => void,
): void {
  canvas.addEventListener("webglcontextlost", () => {
    dispatch({ type: "notify", text: DROPPED });
    holder.forget();
  });
  canvas.addEventListener("webglcontextrestored", () => {
    holder.renew();
    dispatch({ type: "dismiss", texts: [DROPPED] });
  });
}
