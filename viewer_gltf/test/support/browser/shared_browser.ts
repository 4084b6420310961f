/**
 * One browser for all files of tests that run one after another: its start is most of what a small
 * file takes. It ends with the process that the files share.
 */
import { type Browser, enter, type Surroundings, startChromium } from "./chromium";

let started: ReturnType<typeof startChromium> | undefined;

/** A profile of its own in it, with nothing kept; what is closed is that alone. */
export async function openBrowser(surroundings: Surroundings): Promise<Browser> {
  started ??= startChromium();
  return enter(await started, surroundings);
}
