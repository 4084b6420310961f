/** The interface of a control's element, and the attributes by which scripts find it. */
import type { Control, Refusal, Wish } from "../controls";

export type Send = (wish: Wish | Refusal) => void;

/** What a control asks for, or why it does nothing now. */
export function askedBy({ refusal }: Control, wish: () => Wish): Wish | Refusal {
  return refusal ? { refusal } : wish();
}

/** `update` is called with the control as it is now, whenever anything may have changed. */
export type Widget<C> = Readonly<{ root: HTMLElement; update: (control: C) => void }>;

/** `data-control`: its id; of a channel's control also `data-part`, what it is of the channel. */
export function hooks(id: string): Readonly<Record<string, string>> {
  const at = id.indexOf("/");
  return at === -1 ? { control: id } : { control: id, part: id.slice(at + 1) };
}
