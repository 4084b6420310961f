/** Sizes for fingers and eyes: targets of at least 24 px, and text that grows with the user's font size. */
import { describe, expect, it } from "vitest";
import { openAllSections } from "../support/browser/open_sections";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";

/** Edge of the smallest target, CSS px (WCAG 2.5.8). */
const TARGET_PX = 24;
const SIZES = [
  [390, 844],
  [900, 600],
] as const;

/** Runs in the page: targets that are smaller. Two sliders on one track are measured separately. */
function smallTargets(least_px: number): string[] {
  const all = document.querySelectorAll<HTMLElement>(
    "button, select, input:not(.ends input), a[href], summary, [role=application], [role=slider]",
  );
  return [...all]
    .filter((each) => each.checkVisibility())
    .flatMap((each) => {
      const { width, height } = each.getBoundingClientRect();
      const isLarge = width > least_px - 0.01 && height > least_px - 0.01;
      return isLarge ? [] : [`${width} x ${height}: ${each.outerHTML.slice(0, 120)}`];
    });
}

/** Runs in the page: places around the thumb at the lower end that do not hit the thumb. */
function missedThumb(size_px: number): string[] {
  const track = document.querySelector<HTMLElement>(".ends");
  track?.scrollIntoView({ block: "center" });
  const { left, top, height } = track?.getBoundingClientRect() ?? new DOMRect();
  const middle = { x: left + size_px / 2, y: top + height / 2 };
  const reach = size_px / 2 - 1;
  return [
    [reach, 0],
    [-reach, 0],
    [0, reach],
    [0, -reach],
  ].flatMap(([x, y]) => {
    const found = document.elementFromPoint(middle.x + x, middle.y + y) as HTMLElement | null;
    return /window-low$/.test(found?.dataset.control ?? "") ? [] : [`${x} ${y}: ${found?.tagName}`];
  });
}

/** Runs in the page: lists that are narrower than their longest choice. */
function narrowLists(): string[] {
  const lists = [...document.querySelectorAll("select")].filter((each) => each.checkVisibility());
  return lists.flatMap((list) => {
    const roomy = list.cloneNode(true) as HTMLSelectElement;
    roomy.style.cssText = "position: absolute; width: max-content; max-width: none";
    list.after(roomy);
    const [wide_px, there_px] = [roomy.offsetWidth, list.offsetWidth];
    roomy.remove();
    return wide_px > there_px + 1 ? [`${list.dataset.control}: ${wide_px} in ${there_px}`] : [];
  });
}

type Text = Readonly<{ text: string; font_px: number; isCut: boolean }>;
type Texts = Readonly<{ texts: readonly Text[]; overlaps: readonly string[] }>;

/**
 * Runs in the page: the visible texts of the panel and over the view, with their sizes, cuts and
 * overlaps.
 */
function textsOf(root: string): Texts {
  const walker = document.createTreeWalker(
    document.querySelector(root) ?? document.body,
    NodeFilter.SHOW_TEXT,
  );
  const found: { text: string; parent: HTMLElement; box: DOMRect; lines: DOMRect[] }[] = [];
  for (let node = walker.nextNode(); node !== null; node = walker.nextNode()) {
    const { parentElement: parent, textContent } = node;
    const text = textContent?.trim() ?? "";
    if (text === "" || parent === null || !parent.checkVisibility()) continue;
    const isHidden = parent.closest("svg, option, .first-hint.gone, [aria-hidden=true], .label");
    if (isHidden !== null && parent.closest(".item-shown, .item-mode, svg, option, .gone"))
      continue;
    const range = document.createRange();
    range.selectNodeContents(node);
    const lines = [...range.getClientRects()];
    found.push({ text, parent, box: range.getBoundingClientRect(), lines });
  }
  const texts = found.map(({ text, parent, box }) => {
    const ancestors: HTMLElement[] = [];
    for (let each: HTMLElement | null = parent; each; each = each.parentElement)
      ancestors.push(each);
    const clips = ancestors.filter((each) => getComputedStyle(each).overflowX !== "visible");
    // a name that is too long ends with dots, and is complete in its title
    const isTitled = parent.title === text;
    const isCut = clips.some((each) => {
      const { left, right } = each.getBoundingClientRect();
      return box.left < left - 1 || box.right > right + 1;
    });
    return {
      text,
      font_px: Number.parseFloat(getComputedStyle(parent).fontSize),
      isCut: isCut && !isTitled,
    };
  });
  const doOverlap = (a: DOMRect, b: DOMRect) => {
    const across = Math.min(a.right, b.right) - Math.max(a.left, b.left);
    const down = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
    return across > 1.5 && down > 3;
  };
  const overlaps = found.flatMap((a, i) =>
    found
      .slice(i + 1)
      .filter((b) => a.lines.some((one) => b.lines.some((other) => doOverlap(one, other))))
      .map((b) => `${a.text} / ${b.text}`),
  );
  return { texts, overlaps };
}

describeInChromium("sizes", () => {
  const stand = prepareStand({ viewport: { width: 900, height: 600 }, isBlind: true });
  const page = () => stand.viewer.page;

  describe.each(SIZES)("at %i x %i", (width, height) => {
    it("are at least 24 px for all targets, also in dialogs, and suit the longest choice of lists", async () => {
      await page().setViewportSize({ width, height });
      await stand.open("&mode=disc");
      expect(await page().evaluate(smallTargets, TARGET_PX)).toEqual([]);
      await openAllSections(stand.viewer);
      expect(await page().evaluate(narrowLists)).toEqual([]);
      await page().keyboard.press("\\");
      await page().locator(".slices .enlarge").first().waitFor();
      await page().keyboard.press("l");
      expect(await page().evaluate(smallTargets, TARGET_PX)).toEqual([]);
      expect(await page().evaluate(missedThumb, TARGET_PX)).toEqual([]);
      await page().keyboard.press("Escape");
      for (const [key, dialog] of [
        ["?", "dialog[data-help]"],
        [":", "dialog[data-card]"],
      ]) {
        await page().keyboard.press(key);
        await page().locator(dialog).waitFor();
        expect(await page().evaluate(smallTargets, TARGET_PX)).toEqual([]);
        await page().keyboard.press("Escape");
        await page().locator(dialog).waitFor({ state: "hidden" });
      }
    });

    it("grow with the user's font size for texts, of which none is cut or covered", async () => {
      await page().setViewportSize({ width, height });
      await stand.open("&mode=off");
      await openAllSections(stand.viewer);
      const byFont: Texts[] = [];
      for (const percent of [100, 150]) {
        await page().evaluate((percent) => {
          document.documentElement.style.fontSize = `${percent}%`;
        }, percent);
        await page().waitForTimeout(100);
        byFont.push(await page().evaluate(textsOf, ".panel .body"));
        const over = await page().evaluate(textsOf, ".view");
        expect(over.overlaps).toEqual([]);
        expect(over.texts.filter(({ isCut }) => isCut)).toEqual([]);
        const { scrolls, tall } = await page().evaluate(() => {
          const body = document.querySelector(".panel .body") as HTMLElement;
          return { scrolls: body.scrollHeight > body.clientHeight, tall: body.clientHeight };
        });
        expect([scrolls, tall > 150]).toEqual([true, true]);
      }
      const [usual, large] = byFont;
      expect(usual.texts.length).toBeGreaterThan(60);
      for (const { texts, overlaps } of byFont) {
        expect(overlaps).toEqual([]);
        expect(texts.filter(({ isCut }) => isCut)).toEqual([]);
      }
      const small = large.texts.filter(
        ({ font_px }, i) => font_px < 1.49 * (usual.texts[i]?.font_px ?? 0),
      );
      expect(small).toEqual([]);
    });
  });
});
