/**
 * One browser for all files of tests that run one after another: its start is most of what a small
 * file takes. Those that run beside them have another: a browser draws its pages in one process.
 */
import { inject } from "vitest";
import { type Browser, enter, HOW_TO_GET, type Surroundings } from "./chromium";

/** A profile of its own in it, with nothing kept; what is closed is that alone. */
export function openBrowser(surroundings: Surroundings): Promise<Browser> {
  const endpoint = inject("chromium").at(Number(process.env.VITEST_POOL_ID) - 1);
  if (endpoint === undefined) throw new Error(HOW_TO_GET);
  return enter(endpoint, surroundings);
}
