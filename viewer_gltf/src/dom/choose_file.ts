/** Ask for a file of the user's. Must be called from within a click or a key. */
import { element } from "./element";

/** @param accept suffixes, as an input's `accept` has them. @returns null: none was chosen */
export function chooseFile(accept: string): Promise<File | null> {
  const input = element("input", { type: "file", accept });
  return new Promise((resolve) => {
    input.addEventListener("change", () => resolve(input.files?.[0] ?? null));
    input.addEventListener("cancel", () => resolve(null));
    input.click();
  });
}
