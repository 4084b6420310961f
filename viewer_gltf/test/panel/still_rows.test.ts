/** No row of the flat panel moves by itself: while a bundle loads, while modes change, while notices come. */
import { describe, expect, it } from "vitest";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand, type Stand } from "../support/browser/stand";
import { IS_EXHAUSTIVE } from "../support/exhaustive";
import { prepareObjects } from "../support/object_bundle";
import { hasPython } from "../support/python";

type Move = Readonly<{ row: string; from: number; to: number }>;

/** Runs in the page before its own scripts: notes each row that is seen at another height than before. */
function watchRows(): void {
  const moves: Move[] = [];
  const places = new Map<string, number>();
  const look = () => {
    const body = document.querySelector(".panel .body");
    if (body !== null) {
      // where the reader has scrolled to is no move
      const offset = body.scrollTop;
      const rows = document.querySelectorAll<HTMLElement>(
        ".panel [data-opener], .panel [data-control], .panel [data-channel]",
      );
      for (const each of rows) {
        const { opener, control, channel } = each.dataset;
        const row = `${opener ?? ""} ${control ?? ""} ${channel ?? ""} ${each.ariaLabel ?? ""}`;
        if (each.getClientRects().length === 0) {
          places.delete(row);
          continue;
        }
        const at = each.getBoundingClientRect().top + offset;
        const before = places.get(row);
        if (before !== undefined && Math.abs(at - before) > 0.5) {
          moves.push({ row, from: before, to: at });
        }
        places.set(row, at);
      }
    }
    requestAnimationFrame(look);
  };
  requestAnimationFrame(look);
  Object.assign(window, { moves });
}

/** What has moved since the last look. */
async function movedIn({ viewer: { page } }: Stand): Promise<readonly Move[]> {
  await page.evaluate(async () => {
    for (let i = 0; i < 3; i++) await new Promise(requestAnimationFrame);
  });
  return page.evaluate(() => (window as never as { moves: Move[] }).moves.splice(0));
}

/** Without Light, whose settings come with the mode that has them. */
const SECTIONS = [
  ...["tiles", "cut", "slices", "save", "stereo"],
  ...["view", "volume-settings", "quality", "about"],
];
/** Longer than the figures of the panel take to follow, ms. */
const FIGURES_MS = 400;

describe.each([
  [900, 600],
  [390, 844],
])("the rows of the panel at %i x %i", (width, height) => {
  const viewport = { width, height };

  describeInChromium("of a first visit", () => {
    const stand = prepareStand({ viewport, isBlind: true, isFirstVisit: true });

    it("stay while the bundle loads, and when a tile, an error and an object come", async () => {
      await stand.viewer.page.addInitScript(watchRows);
      await stand.open();
      await stand.viewer.settled();
      await stand.viewer.page.waitForTimeout(FIGURES_MS);
      expect(await movedIn(stand)).toEqual([]);
      await stand.viewer.page.evaluate(() => {
        setTimeout(() => {
          throw new Error("a fault of the test");
        });
      });
      await stand.viewer.page.locator("[data-notices] p").waitFor();
      for (const key of ["t", "i", "Escape", "Escape", "m", "m", "b", "b"]) {
        await stand.viewer.page.keyboard.press(key);
        await stand.viewer.page.waitForTimeout(FIGURES_MS);
      }
      expect(await movedIn(stand)).toEqual([]);
    });
  });

  describeInChromium("with sections open", () => {
    const stand = prepareStand({ viewport, isBlind: true, isFirstVisit: true });

    // The rows are the same at both sizes, and the narrow panel is the one that has less room for them.
    const isKept = IS_EXHAUSTIVE || width === 390;
    it.runIf(isKept)(
      "stay while modes, slices and channels change, and the swatch of a hidden channel works",
      async () => {
        const { page } = stand.viewer;
        await page.addInitScript(watchRows);
        await stand.open();
        for (const section of SECTIONS) await stand.viewer.unfold(section);
        await stand.viewer.openCard("F_x20_body");
        await stand.viewer.settled();
        await page.waitForTimeout(FIGURES_MS);
        await movedIn(stand);
        for (const key of "mmmmmSSDDvv1\\\\") {
          await page.keyboard.press(key);
          await page.waitForTimeout(FIGURES_MS);
          expect(await movedIn(stand), key).toEqual([]);
        }
        const hidden = (await stand.viewer.snapshot()).state.channels[0];
        expect(hidden.shown).toBe(false);
        await stand.viewer.recolor(hidden.id, "#ff00ff");
        expect((await stand.viewer.snapshot()).state.channels[0].color).toEqual([1, 0, 1]);
        expect(await movedIn(stand)).toEqual([]);
      },
    );
  });
});

describeInChromium("the rows of a label map's panel", () => {
  if (!hasPython) {
    it.skip("needs Python");
    return;
  }
  const stand = prepareStand({
    bundle: prepareObjects(),
    viewport: { width: 900, height: 600 },
    isBlind: true,
    isFirstVisit: true,
  });

  it("stay while the table of the objects loads", async () => {
    await stand.viewer.page.addInitScript(watchRows);
    await stand.open();
    await stand.viewer.settled();
    await stand.viewer.page.waitForTimeout(FIGURES_MS);
    expect(await movedIn(stand)).toEqual([]);
  });
});
