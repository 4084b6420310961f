/**
 * No row of the flat panel moves by itself: during loading, after a change of mode, or when notices
 * appear.
 */
import { describe, expect, it } from "vitest";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand, type Stand } from "../support/browser/stand";
import { IS_EXHAUSTIVE } from "../support/exhaustive";
import { prepareObjects } from "../support/object_bundle";
import { hasPython } from "../support/python";

type Move = Readonly<{ row: string; from: number; to: number }>;

/** Runs in the page before its own scripts: records each row whose height on the page changes. */
function watchRows(): void {
  const moves: Move[] = [];
  const places = new Map<string, number>();
  const check = () => {
    const body = document.querySelector(".panel .body");
    if (body !== null) {
      // scrolling by the user is not a move
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
    requestAnimationFrame(check);
  };
  requestAnimationFrame(check);
  Object.assign(window, { moves });
}

/** Returns the rows that have moved since the last call. */
async function movedIn({ viewer: { page } }: Stand): Promise<readonly Move[]> {
  await page.evaluate(async () => {
    for (let i = 0; i < 3; i++) await new Promise(requestAnimationFrame);
  });
  return page.evaluate(() => (window as never as { moves: Move[] }).moves.splice(0));
}

/** The section *Light* is left out, because its settings appear with path tracing. */
const SECTIONS = [
  ...["tiles", "cut", "slices", "save", "stereo"],
  ...["view", "volume-settings", "quality", "about"],
];
/** Milliseconds after which the figures of the panel are updated. */
const FIGURES_MS = 400;

describe.each([
  [900, 600],
  [390, 844],
])("the rows of the panel at %i x %i", (width, height) => {
  const viewport = { width, height };

  describeInChromium("on a first visit", () => {
    const stand = prepareStand({ viewport, isBlind: true, isFirstVisit: true });

    it("stay while the bundle loads, and when a tile is selected or a notice appears", async () => {
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

    // The rows are the same at both sizes; the narrow panel has less space for them.
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
