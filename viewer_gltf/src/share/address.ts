/** The page's address as the page itself writes it: always in place of the old one, never as a step of the history. */
import { store, stored } from "../dom/stored";

/** The words that a reader has typed stay in the tab. They are no part of an address that follows the view. */
const TYPED = "stereocell-typed";

let own = globalThis.location?.href;

/** False once a link or the reader has written another address: the page is about to open it. */
export function isOwnAddress(): boolean {
  return location.href === own;
}

/** Whether the present step of the history is the split screen's: it goes when that is left, and its address with it. */
export function isPassingStep(): boolean {
  return (history.state as { split?: number } | null)?.split !== undefined;
}

/** Throws a DOMException where the browser allows no more changes. */
export function writeAddress(address: URL): void {
  history.replaceState(history.state, "", address);
  own = location.href;
}

/**
 * Keep a link with typed words for a reload of this tab.
 *
 * @param link the whole view; null: the address has all of it
 */
export function keepTyped(link: string | null): void {
  store(TYPED, link && JSON.stringify([location.hash, link]), "in-tab");
}

/** The link behind an address's `#`, with the words that were typed in this tab. */
export function withTyped(hash: string): string {
  const [address, link] = JSON.parse(stored(TYPED, "in-tab") ?? "[]");
  return address === hash ? link : hash;
}
