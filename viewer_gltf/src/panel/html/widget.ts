/** The interface of a control's element, and the attributes by which scripts find it. */
import type { Control, Refusal, Request } from "../controls";

export type Send = (request: Request | Refusal) => void;

/** Returns the request of a control, or why it has no effect now. */
export function requestOrRefusal({ refusal }: Control, request: () => Request): Request | Refusal {
  return refusal ? { refusal } : request();
}

/** `update` is called with the present control whenever anything may have changed. */
export type Widget<C> = Readonly<{ root: HTMLElement; update: (control: C) => void }>;

/**
 * `data-control` is the id of a control; for a channel's control, `data-part` is the part after the
 * channel.
 */
export function hooks(id: string): Readonly<Record<string, string>> {
  const at = id.indexOf("/");
  return at === -1 ? { control: id } : { control: id, part: id.slice(at + 1) };
}
