/** An empty page for numbers from the GPU, by chunks of shaders or by a harness. */
import type { Page } from "playwright-core";
import { afterAll, beforeAll } from "vitest";
import { readChunks, runProgram } from "../shaders/chunk";
import { bundled } from "./bundled";
import type { Browser } from "./chromium";
import { openBrowser } from "./shared_browser";

type Calls = Readonly<Record<string, (...given: never[]) => unknown>>;

export type BarePage<H extends Calls> = Readonly<{
  page: Page;
  /** Calls a function of the harness and returns its result. */
  call: <K extends keyof H & string>(
    name: K,
    ...given: Parameters<H[K]>
  ) => Promise<ReturnType<H[K]>>;
  /** Returns `oColor` after `body`, which uses chunks (see runProgram). */
  run: (
    chunks: readonly string[],
    head: string,
    body: string,
    uniforms?: Parameters<typeof runProgram>[4],
    pixels?: number,
  ) => Promise<readonly number[]>;
}>;

/**
 * Sets up and closes the page around the tests of one `describe`. Must be called inside it.
 *
 * @param harness module that puts its functions on the window, as `harness`
 */
export function prepareBarePage<H extends Calls>(harness?: URL): BarePage<H> {
  let browser: Browser;
  let page: Page;

  beforeAll(async () => {
    browser = await openBrowser({ viewport: { width: 64, height: 64 } });
    page = await browser.context.newPage();
    if (harness !== undefined) await page.addScriptTag({ content: await bundled(harness) });
  });

  afterAll(() => browser?.close());

  return {
    get page() {
      return page;
    },
    async call(name, ...given) {
      // arguments are sent as text: volumes are long, and playwright would wrap every number
      // separately
      const answer = await page.evaluate(
        ([name, given]) => {
          const { harness } = window as {
            harness?: Record<string, (...each: unknown[]) => unknown>;
          };
          return JSON.stringify(harness?.[name]?.(...JSON.parse(given)));
        },
        [name, JSON.stringify(given)] as const,
      );
      if (answer === undefined) throw new Error(`the page has no harness with ${name}`);
      return JSON.parse(answer) as ReturnType<H[typeof name]>;
    },
    async run(names, head, body, textures = {}, pixels = 1) {
      const includes = names.map((name) => `#include <chunks/${name}>`).join("\n");
      const chunks = await readChunks(...names);
      return runProgram(page, chunks, `${head}\n${includes}`, body, textures, pixels);
    },
  };
}
