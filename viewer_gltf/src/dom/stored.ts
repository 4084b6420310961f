/** Texts that the browser stores for this page: permanently, or until the tab is closed. */

function storageOf(lasts: "for-good" | "in-tab"): Storage {
  return lasts === "in-tab" ? sessionStorage : localStorage;
}

/** Returns a stored text; null: there is none, or this browser stores nothing. */
export function stored(key: string, lasts: "for-good" | "in-tab" = "for-good"): string | null {
  try {
    return storageOf(lasts).getItem(key);
  } catch {
    return null;
  }
}

/** Stores a text. If the browser stores nothing, the next visit begins without the text. */
export function store(
  key: string,
  text: string | null,
  lasts: "for-good" | "in-tab" = "for-good",
): void {
  try {
    if (text === null) storageOf(lasts).removeItem(key);
    else storageOf(lasts).setItem(key, text);
  } catch {
    // the browser forbids storage
  }
}
