/** Browser tests need Chromium. Without it they are skipped with a message, or fail in CI. */
import { describe } from "vitest";
import { HOW_TO_GET, hasChromium } from "./chromium";

export function describeInChromium(name: string, tests: () => void): void {
  if (hasChromium()) describe(name, tests);
  else if (process.env.CI) throw new Error(HOW_TO_GET);
  else {
    process.stderr.write(`skipped: ${name}: ${HOW_TO_GET}\n`);
    describe.skip(name, tests);
  }
}
