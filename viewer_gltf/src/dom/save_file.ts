/** Hand a file to the user, as a download. */
import { element } from "./element";

/** Time for the browser to read it, ms. */
const KEPT_MS = 60_000;

export function saveFile(name: string, content: Blob): void {
  const href = URL.createObjectURL(content);
  const link = element("a", { href, download: name, hidden: true });
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(href), KEPT_MS);
}

/** A name for files of a specimen: letters, digits and lines alone. */
export function fileName(specimen: string, what: string, suffix: string): string {
  const plain = specimen.replaceAll(/[^\p{L}\p{N}]+/gu, "-").replaceAll(/^-+|-+$/g, "");
  return `${[plain.slice(0, 60), what].filter((part) => part !== "").join("-")}.${suffix}`;
}
