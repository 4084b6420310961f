/** The link to iOS's own viewer of augmented reality. */
import { join } from "node:path";
import { expect, it } from "vitest";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";

const SHOTS = process.env.STEREOCELL_SHOTS;

describeInChromium("the link to augmented reality", () => {
  const stand = prepareStand({
    viewport: { width: 390, height: 844 },
    hasTouch: true,
    isBlind: SHOTS === undefined,
  });
  const link = () => stand.viewer.page.locator('[data-overlay="ar"]');

  const pretendIos = () =>
    stand.viewer.page.addInitScript(() => {
      const { supports } = DOMTokenList.prototype;
      DOMTokenList.prototype.supports = function (token) {
        return token === "ar" || supports.call(this, token);
      };
    });

  it("is hidden if the browser has no such viewer", async () => {
    await stand.open("&mode=off");
    expect(await link().isVisible()).toBe(false);
  });

  it("is a link with one image, as Quick Look requires", async () => {
    await pretendIos();
    await stand.open("&mode=off");
    expect(await link().isVisible()).toBe(true);
    const about = await link().evaluate((a: HTMLAnchorElement) => ({
      rel: a.rel,
      path: new URL(a.href).pathname,
      nodes: [...a.childNodes].map(({ nodeName }) => nodeName),
      words: a.querySelector("img")?.alt,
      isDrawn: (a.querySelector("img")?.naturalWidth ?? 0) > 0,
    }));
    expect(about).toEqual({
      rel: "ar",
      path: "/bundle/specimen.usdz",
      nodes: ["IMG"],
      words: "View in your room",
      isDrawn: true,
    });
    if (SHOTS) await stand.viewer.page.screenshot({ path: join(SHOTS, "ar_link.png") });
  });

  it("is hidden if the bundle has no such file", async () => {
    await pretendIos();
    const manifest = { ...stand.manifest, usdz: null, usdz_reason: "no surface is drawn" };
    stand.host.overrides.set("/bundle/manifest.json", {
      status: 200,
      body: JSON.stringify(manifest),
    });
    await stand.open("&mode=off");
    expect(await link().isVisible()).toBe(false);
  });
});
