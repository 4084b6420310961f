/** One browser for all files of tests: its start is most of what a small file takes. */
import { inject } from "vitest";
import { type Browser, enter, HOW_TO_GET, type Surroundings } from "./chromium";

/** A profile of its own in it, with nothing kept; what is closed is that alone. */
export function openBrowser(surroundings: Surroundings): Promise<Browser> {
  const endpoint = inject("chromium");
  if (endpoint === null) throw new Error(HOW_TO_GET);
  return enter(endpoint, surroundings);
}
