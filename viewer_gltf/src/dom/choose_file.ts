/** Asks the user for a file. Must be called within a click or a key. */
import { element } from "./element";

/** @param accept suffixes, as in an input's `accept` @returns null: no file was chosen */
export function chooseFile(accept: string): Promise<File | null> {
  const input = element("input", { type: "file", accept });
  return new Promise((resolve) => {
    input.addEventListener("change", () => resolve(input.files?.[0] ?? null));
    input.addEventListener("cancel", () => resolve(null));
    input.click();
  });
}
