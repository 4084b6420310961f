/** Drops the graphics context of a page, like a graphics driver, and restores it. */
import type { Page } from "playwright-core";

/** Stores the context that the page draws with. Must be called before the page opens. */
export function rememberContext(page: Page): Promise<unknown> {
  return page.addInitScript(() => {
    const original = HTMLCanvasElement.prototype.getContext;
    HTMLCanvasElement.prototype.getContext = function (this: HTMLCanvasElement, ...given) {
      const made = (original as (...each: unknown[]) => unknown).apply(this, given);
      if (made instanceof WebGL2RenderingContext) Object.assign(window, { drawnBy: made });
      return made as never;
    };
  });
}

/** Drops or restores the stored context. */
export function changeContext(page: Page, change: "loseContext" | "restoreContext"): Promise<void> {
  return page.evaluate((each) => {
    const stored = window as unknown as {
      drawnBy: WebGL2RenderingContext;
      loss?: WEBGL_lose_context | null;
    };
    stored.loss ??= stored.drawnBy.getExtension("WEBGL_lose_context");
    stored.loss?.[each]();
  }, change);
}
