/**
 * The page's Content-Security-Policy: nothing that the viewer does violates it, and it forbids
 * everything else.
 */
import { createHash } from "node:crypto";
import { readFile } from "node:fs/promises";
import { join } from "node:path";
import { afterAll, beforeAll, describe, expect, it } from "vitest";
import { addHeadset } from "../support/browser/chromium";
import { Host } from "../support/browser/host";
import { describeInChromium } from "../support/browser/skip";
import { DEMO_BUNDLE, DIST, MAPS_BUNDLE, prepareStand } from "../support/browser/stand";

const VIOLATION = /content.security.policy/i;

describe("the policy", () => {
  it("names the hashes of the page's own scripts and style, and nothing unsafe", async () => {
    const page = await readFile(join(DIST, "index.html"), "utf8");
    const policy = /http-equiv="Content-Security-Policy"\s+content="([^"]*)"/.exec(page)?.[1] ?? "";
    const hashesOf = (tag: string) =>
      [...page.matchAll(new RegExp(`<${tag}>([\\s\\S]*?)</${tag}>`, "g"))].map(
        ([, text]) => `'sha256-${createHash("sha256").update(text).digest("base64")}'`,
      );
    const named = (directive: string) =>
      (new RegExp(`${directive} ([^;]*);`).exec(policy)?.[1] ?? "").split(" ").sort();
    expect(hashesOf("script")).toHaveLength(2);
    // the page unpacks code and style, which are blobs
    const run = ["'self'", "blob:", "'wasm-unsafe-eval'", ...hashesOf("script")];
    expect(named("script-src")).toEqual(run.sort());
    expect(named("style-src")).toEqual(["'self'", "blob:", ...hashesOf("style")].sort());
    expect(policy).toMatch(/^default-src 'none';/);
    expect(policy).not.toMatch(/unsafe-inline|'unsafe-eval'|\*/);
  });
});

describe.skipIf(!MAPS_BUNDLE)("surfaces with baked maps", () => {
  describeInChromium("under the page's policy", () => {
    const stand = prepareStand({
      bundle: MAPS_BUNDLE,
      viewport: { width: 480, height: 270 },
      pixelRatio: 1,
    });

    it("are drawn, with their images transcoded", async () => {
      const reported: string[] = [];
      const fetched: string[] = [];
      stand.viewer.page.on("console", (message) => {
        if (VIOLATION.test(message.text())) reported.push(message.text());
      });
      stand.viewer.page.on("request", (request) => fetched.push(request.url()));
      await stand.open("&mode=off");
      await stand.viewer.settled();
      expect((await stand.viewer.snapshot()).triangles).toBeGreaterThan(0);
      expect((await stand.viewer.snapshot()).state.notices).toEqual([]);
      expect(fetched.some((url) => /basis|transcod/i.test(url))).toBe(true);
      expect(reported).toEqual([]);
    });
  });
});

describeInChromium("the page's policy", () => {
  const stand = prepareStand({ bundle: DEMO_BUNDLE, viewport: { width: 480, height: 270 } });
  let other: Host;

  beforeAll(async () => {
    other = await Host.start({ "/": stand.bundle });
  });

  afterAll(async () => {
    await other?.stop();
  });

  /** The browser's reports of violations of the policy. */
  function watch(): string[] {
    const reported: string[] = [];
    stand.viewer.page.on("console", (message) => {
      if (VIOLATION.test(message.text())) reported.push(message.text());
    });
    return reported;
  }

  it("allows surfaces, volumes and stereo", async () => {
    const reported = watch();
    await addHeadset(stand.viewer.page);
    await stand.open("&mode=tile&switch=9");
    await stand.viewer.settled();
    expect((await stand.viewer.snapshot()).triangles).toBeGreaterThan(0);
    const [{ id }] = stand.manifest.channels;
    await stand.viewer.drawVolume(id, true);
    await stand.viewer.chooseTile(stand.manifest.tiles[0].id);
    expect((await stand.viewer.snapshot()).volumes.length).toBeGreaterThan(0);
    await stand.viewer.chooseMode("off"); // software draws volumes for two eyes slowly
    await stand.viewer.enterStereo();
    expect((await stand.viewer.snapshot()).state.notices).toEqual([]);
    expect(reported).toEqual([]);
  });

  it("forbids scripts, styles and frames that are put into the page", async () => {
    const reported = watch();
    await stand.open("&mode=off");
    const ran = await stand.viewer.page.evaluate(async (host) => {
      const script = document.createElement("script");
      script.textContent = "document.body.dataset.ran = 'inline'";
      const remote = document.createElement("script");
      remote.src = `${host}/script.js`;
      const image = document.createElement("img");
      image.setAttribute("onerror", "document.body.dataset.ran = 'handler'");
      image.src = "data:,";
      const frame = document.createElement("iframe");
      frame.src = `${host}/`;
      document.body.append(script, remote, image, frame);
      await new Promise((resolve) => setTimeout(resolve, 500));
      return document.body.dataset.ran ?? null;
    }, other.address);
    expect(ran).toBeNull();
    expect(other.requests).toEqual([]);
    expect(reported.length).toBeGreaterThanOrEqual(4);
  });

  const reach = (address: string) =>
    stand.viewer.page.evaluate(async (url) => {
      try {
        await fetch(url, { mode: "no-cors" });
        return true;
      } catch {
        return false;
      }
    }, address);

  it("allows only its own host", async () => {
    await stand.open("&mode=off");
    expect(await reach(`${other.address}/manifest.json`)).toBe(false);
    expect(await reach(`${stand.host.address}/bundle/manifest.json`)).toBe(true);
    expect(other.requests).toEqual([]);
  });

  it("allows the host that the address names for the bundle, and no third one", async () => {
    const third = await Host.start({ "/": stand.bundle });
    await stand.viewer.page.goto(`${stand.host.address}/app/?bundle=${other.address}/`);
    expect(await reach(`${other.address}/manifest.json`)).toBe(true);
    expect(await reach(`${third.address}/manifest.json`)).toBe(false);
    expect(third.requests).toEqual([]);
    await third.stop();
  });
});
