/** Saves a file on the user's device, as a download. */
import { element } from "./element";

/** Milliseconds for which the file stays available to the browser. */
const KEPT_MS = 60_000;

export function saveFile(name: string, content: Blob): void {
  const href = URL.createObjectURL(content);
  const link = element("a", { href, download: name, hidden: true });
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(href), KEPT_MS);
}

/** Returns a name for files of a specimen, from letters, digits and hyphens. */
export function fileName(specimen: string, content: string, suffix: string): string {
  const plain = specimen.replaceAll(/[^\p{L}\p{N}]+/gu, "-").replaceAll(/^-+|-+$/g, "");
  return `${[plain.slice(0, 60), content].filter((part) => part !== "").join("-")}.${suffix}`;
}
