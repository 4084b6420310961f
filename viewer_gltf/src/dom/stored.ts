/** Texts that the browser keeps for this page: for good, or until the tab is closed. */

function storageOf(lasts: "for-good" | "in-tab"): Storage {
  return lasts === "in-tab" ? sessionStorage : localStorage;
}

/** null: nothing is kept, or this browser keeps nothing. */
export function stored(key: string, lasts: "for-good" | "in-tab" = "for-good"): string | null {
  try {
    return storageOf(lasts).getItem(key);
  } catch {
    return null;
  }
}

/** A browser that keeps nothing is no fault: the next visit begins without the text. */
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
