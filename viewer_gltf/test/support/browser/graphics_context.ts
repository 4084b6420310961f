/** Takes the graphics context of a page away, as a graphics driver does, and gives it back. */
import type { Page } from "playwright-core";

/** Remembers the context that the page draws with. Must be called before the page opens. */
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

/** Takes the remembered context away, or gives it back. */
export function changeContext(page: Page, change: "loseContext" | "restoreContext"): Promise<void> {
  return page.evaluate((each) => {
    const held = window as unknown as {
      drawnBy: WebGL2RenderingContext;
      loss?: WEBGL_lose_context | null;
    };
    held.loss ??= held.drawnBy.getExtension("WEBGL_lose_context");
    held.loss?.[each]();
  }, change);
}
