/**
 * One browser for all test files that run one after another, because its start takes most of the
 * time of a small file. It ends with the process of the files.
 */
import { type Browser, enter, type Surroundings, startChromium } from "./chromium";

let started: ReturnType<typeof startChromium> | undefined;

/** Opens a separate, empty context in the shared browser. Closing it closes only that context. */
export async function openBrowser(surroundings: Surroundings): Promise<Browser> {
  started ??= startChromium();
  return enter(await started, surroundings);
}
