/** Figures of a page that must not grow with its use. */
import type { CDPSession, Page } from "playwright-core";

export type Figures = Readonly<{
  listeners: number;
  nodes: number;
  heap_bytes: number;
  geometries: number;
  textures: number;
  programs: number;
}>;

export class Figured {
  private constructor(
    private readonly page: Page,
    private readonly devtools: CDPSession,
  ) {}

  static async of(page: Page): Promise<Figured> {
    return new Figured(page, await page.context().newCDPSession(page));
  }

  /** Returns the figures after garbage collection. */
  async now(): Promise<Figures> {
    // objects that one collection frees may refer to others, which the next one frees
    for (let i = 0; i < 3; i++) await this.devtools.send("HeapProfiler.collectGarbage");
    const { jsEventListeners, nodes } = await this.devtools.send("Memory.getDOMCounters");
    const { usedSize } = await this.devtools.send("Runtime.getHeapUsage");
    const gpu = await this.page.evaluate(() => window.stereocell?.snapshot().gpuObjects);
    if (gpu === undefined) throw new Error("the page has no window.stereocell");
    return { listeners: jsEventListeners, nodes, heap_bytes: usedSize, ...gpu };
  }
}
