/** Writes the page's address. It replaces the old one and never adds a step to the browser's history. */
import { store, stored } from "../dom/stored";

/** Storage key, for this tab only. Text that a user has typed stays in the tab and is left out of the address. */
const TYPED = "stereocell-typed";

let own = globalThis.location?.href;

/** Returns false once a link or the user has set another address, which the page is about to open. */
export function isOwnAddress(): boolean {
  return location.href === own;
}

/** Returns whether the split screen made the present step of the history; leaving the split screen removes this step. */
export function isPassingStep(): boolean {
  return (history.state as { split?: number } | null)?.split !== undefined;
}

/** Writes the address. Throws a DOMException if the browser allows no more changes. */
export function writeAddress(address: URL): void {
  history.replaceState(history.state, "", address);
  own = location.href;
}

/**
 * Keeps a link with typed text for a reload of this tab.
 *
 * @param link to the whole view; null if the address already contains the whole view
 */
export function keepTyped(link: string | null): void {
  store(TYPED, link && JSON.stringify([location.hash, link]), "in-tab");
}

/** Returns the link after an address's `#`, including text that was typed in this tab. */
export function withTyped(hash: string): string {
  const [address, link] = JSON.parse(stored(TYPED, "in-tab") ?? "[]");
  return address === hash ? link : hash;
}
