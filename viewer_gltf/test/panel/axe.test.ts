/** axe-core finds no violation on the page, by the rules of WCAG 2.2 at levels A and AA. */
import axe from "axe-core";
import { describe, expect, it } from "vitest";
import { openAllSections } from "../support/browser/open_sections";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";
import { IS_EXHAUSTIVE } from "../support/exhaustive";

declare global {
  interface Window {
    axe: typeof axe;
  }
}

const RULES = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa", "best-practice"];
/** Query and preferred colour scheme, by the name of the theme. */
const THEMES = {
  dark: { query: "", colorScheme: "dark" },
  light: { query: "&theme=light", colorScheme: "light" },
} as const;
/** Two sliders share a track, and only their thumbs take the pointer. sizes.test.ts measures those. */
const TWO_ON_A_TRACK = /window-(low|high)"/;
const DESK = { width: 900, height: 600 };
const PHONE = { width: 390, height: 844 };

describeInChromium("axe-core", () => {
  const stand = prepareStand({ viewport: DESK, isBlind: true });
  const page = () => stand.viewer.page;

  /** Returns each finding as one line: rule, element and reason. */
  async function findings(): Promise<readonly string[]> {
    const isThere = await page().evaluate(() => "axe" in window);
    if (!isThere) await page().evaluate(axe.source); // the page's policy allows no foreign scripts
    const { violations } = await page().evaluate(
      (values) => window.axe.run({ runOnly: { type: "tag", values }, resultTypes: ["violations"] }),
      RULES,
    );
    return violations.flatMap(({ id, nodes }) =>
      nodes
        .filter(({ html }) => !(id === "target-size" && TWO_ON_A_TRACK.test(html)))
        .map(({ html, failureSummary }) => `${id}: ${html.slice(0, 160)} ${failureSummary}`),
    );
  }

  describe.each(Object.entries(THEMES))("in the %s theme", (theme, { query, colorScheme }) => {
    const open = async () => {
      await page().emulateMedia({ colorScheme });
      await stand.open(`&mode=off${query}`);
    };

    /** Sizes depend on the window and colours on the theme, so one theme is enough on a phone. */
    const hasPhone = IS_EXHAUSTIVE || theme === Object.keys(THEMES)[0];
    async function findingsOnPhone(): Promise<readonly string[]> {
      if (!hasPhone) return [];
      await page().setViewportSize(PHONE);
      const found = await findings();
      await page().setViewportSize(DESK);
      return found;
    }

    it("finds nothing on the opening page, nor with all sections open, a link and a selected tile", async () => {
      await open();
      expect(await findings()).toEqual([]);
      expect(await findingsOnPhone()).toEqual([]);
      await openAllSections(stand.viewer);
      await page().keyboard.press("l");
      await page().locator('[data-control="link"]').waitFor();
      await page().keyboard.press("Escape");
      for (const key of ["b", "n", "p", "t", "i"]) await page().keyboard.press(key);
      expect(await findings()).toEqual([]);
      expect(await findingsOnPhone()).toEqual([]);
    });

    it("finds nothing in the dialogs of the keys and of measuring the screen", async () => {
      await open();
      await page().keyboard.press("?");
      await page().locator("dialog[data-help]").waitFor();
      expect(await findings()).toEqual([]);
      expect(await findingsOnPhone()).toEqual([]);
      await page().keyboard.press("Escape");
      await page().keyboard.press(":");
      await page().locator("dialog[data-card]").waitFor();
      expect(await findings()).toEqual([]);
      expect(await findingsOnPhone()).toEqual([]);
    });

    it("finds nothing in slice images, in the announcement of a key, and in a notice", async () => {
      const { pathname } = new URL(
        "channels/Balls/r0_c0/lod2.glb",
        `${stand.host.address}/bundle/`,
      );
      stand.host.overrides.set(pathname, { status: 404, body: "gone" });
      await open();
      await page().locator("[data-notices] p").first().waitFor();
      await page().keyboard.press("\\");
      await page().locator(".slices figure").first().waitFor();
      await page().keyboard.press("k");
      expect(await findings()).toEqual([]);
    });
  });

  it("finds nothing in the card of a tapped place, and in an empty view", async () => {
    await stand.open("&mode=off");
    await stand.viewer.settled();
    await page().keyboard.press("Enter"); // a tap in the middle of the view
    await page().locator(".tap-card").waitFor();
    expect(await findings()).toEqual([]);
    await page().keyboard.press("Escape");
    for (const key of ["1", "2", "3"]) await page().keyboard.press(key);
    await page().locator(".view-message").waitFor();
    expect(await findings()).toEqual([]);
  });

  it("finds nothing in the section of stereo on an upright phone", async () => {
    await page().setViewportSize(PHONE);
    await stand.open("&mode=off");
    await stand.viewer.unfold("stereo");
    await page().locator('[data-control="lenses"]').selectOption("own");
    expect(await findings()).toEqual([]);
    await page().locator('[data-control="lenses"]').selectOption("v2");
    await page().keyboard.press("P");
    await page().getByText("Turn the phone on its side").waitFor();
    expect(await findings()).toEqual([]);
  });

  it("finds nothing on the page of a missing bundle", async () => {
    stand.host.overrides.set("/bundle/manifest.json", { status: 404, body: "gone" });
    await page().goto(`${stand.host.address}/app/?bundle=../bundle/`);
    await page().locator("[data-fatal]").waitFor();
    expect(await findings()).toEqual([]);
  });
});
