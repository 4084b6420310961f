/** Files that the page saves: images larger than the screen, videos, and tables of measurements. */
import { mkdtemp, readFile, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import type { Download } from "playwright-core";
import { afterAll, beforeAll, expect, it } from "vitest";
import { describeInChromium } from "../support/browser/skip";
import { prepareStand } from "../support/browser/stand";

const SHOTS = process.env.STEREOCELL_SHOTS;

describeInChromium("a file that the page saves", () => {
  const stand = prepareStand({
    viewport: { width: 560, height: 240 },
    pixelRatio: 1,
    sharesPage: true,
  });
  const page = () => stand.viewer.page;
  const saved = async (key: string): Promise<Download> => {
    const [download] = await Promise.all([
      page().waitForEvent("download", { timeout: 60_000 }),
      page().keyboard.press(key),
    ]);
    return download;
  };
  let folder: string;
  const contentOf = async (download: Download) => {
    const path = join(SHOTS ?? folder, download.suggestedFilename());
    await download.saveAs(path);
    return readFile(path);
  };

  beforeAll(async () => {
    folder = await mkdtemp(join(tmpdir(), "stereocell-saved-"));
    await stand.open("&mode=off#v=1&points=8,-8,12,20,-8,12");
    await stand.viewer.settled();
    await page().keyboard.press("ArrowRight");
    await stand.viewer.still();
  });

  afterAll(() => rm(folder, { recursive: true, force: true }));

  it("is an image of four times the screen's size that shows the same, with a scale bar", async () => {
    const stage = await page().locator(".stage canvas").boundingBox();
    await page().keyboard.press("0"); // the size of images, from 2 to 4 times the screen's
    const download = await saved('"');
    expect(download.suggestedFilename()).toBe("Fixture-picture.png");
    const png = await contentOf(download);
    expect([png.readUInt32BE(16), png.readUInt32BE(20)]).toEqual([
      4 * (stage?.width ?? 0),
      4 * (stage?.height ?? 0),
    ]);
    // A reduced copy of the image equals the screen, except for announcements over the view.
    await page().evaluate(() => {
      const announced = document.querySelector<HTMLElement>(".announcement");
      if (announced !== null) announced.style.visibility = "hidden";
    });
    const screen = await page().screenshot({ clip: stage ?? undefined });
    const differing = await page().evaluate(
      async ([a, b]) => {
        const load = async (base64: string) => {
          const blob = await (await fetch(`data:image/png;base64,${base64}`)).blob();
          return createImageBitmap(blob);
        };
        const [large, small] = [await load(a), await load(b)];
        const { width, height } = small;
        const draw = (image: ImageBitmap) => {
          const canvas = Object.assign(document.createElement("canvas"), { width, height });
          const context = canvas.getContext("2d");
          if (context === null) throw new Error("no canvas");
          context.imageSmoothingQuality = "high";
          context.drawImage(image, 0, 0, width, height);
          return context.getImageData(0, 0, width, height).data;
        };
        const [p, q] = [draw(large), draw(small)];
        let count = 0;
        for (let i = 0; i < p.length; i += 4) {
          if (Math.abs(p[i] - q[i]) + Math.abs(p[i + 1] - q[i + 1]) > 90) count++;
        }
        return count / (width * height);
      },
      [png.toString("base64"), screen.toString("base64")] as const,
    );
    expect(differing).toBeLessThan(0.06); // edges differ, and the screen has no legend
  });

  it("is a video through the saved views, which plays", async () => {
    await page().keyboard.press("'");
    await page().keyboard.press("ArrowLeft");
    await stand.viewer.still();
    await page().keyboard.press("'");
    const download = await saved(")");
    const file = await contentOf(download);
    expect(download.suggestedFilename()).toBe("Fixture-video.webm");
    const blank = await page().context().newPage(); // the viewer's own policy forbids videos
    const played = await blank.evaluate(async (base64) => {
      const bytes = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
      const video = document.createElement("video");
      video.src = URL.createObjectURL(new Blob([bytes], { type: "video/webm" }));
      await new Promise((resolve, reject) => {
        video.onloadeddata = resolve;
        video.onerror = () => reject(new Error(video.error?.message));
      });
      return { duration: video.duration, width: video.videoWidth };
    }, file.toString("base64"));
    await blank.close();
    await page().bringToFront();
    expect(played.duration).toBeCloseTo(61 / 30, 2);
    expect(played.width).toBeGreaterThan(100);
  });

  it("is a zip of images if the browser has no encoder", async () => {
    await page().evaluate(() => {
      Object.assign(window, { VideoEncoder: undefined });
    });
    // The file is read when the page creates it, since the browser would ask before a second automatic download.
    await page().evaluate(() => {
      const make = URL.createObjectURL.bind(URL);
      URL.createObjectURL = (blob: Blob) => {
        Object.assign(window, { handed: blob });
        return make(blob);
      };
    });
    await page().keyboard.press(")");
    await page().waitForFunction(() => "handed" in window, null, { timeout: 60_000 });
    const base64 = await page().evaluate(async () => {
      const { handed } = window as unknown as { handed: Blob };
      const bytes = new Uint8Array(await handed.arrayBuffer());
      return btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join(""));
    });
    const zip = Buffer.from(base64, "base64");
    expect(zip.subarray(0, 4)).toEqual(Buffer.from("PK\u0003\u0004"));
    expect(zip.readUInt16LE(zip.length - 12)).toBe(61); // entries in its list: two seconds of frames, and the last one
  });

  it("is a table of the measurements", async () => {
    const download = await saved("(");
    const csv = (await contentOf(download)).toString();
    expect(csv.split("\r\n")[1]).toBe("Distance 1,distance,12,,8,-8,12,20,-8,12");
  });
});

describeInChromium("a traced picture that the page saves", () => {
  const stand = prepareStand({ viewport: { width: 120, height: 96 } });
  const page = () => stand.viewer.page;
  const announced = () => page().locator("[data-announcement]").textContent();

  it("gathers light in each part until it is clear, and reports its progress", async () => {
    await stand.open("&mode=traced&quality=low#v=1&light=many:false");
    await stand.viewer.settled();
    await page().evaluate(() => {
      const words = new Set<string>();
      const line = document.querySelector("[data-announcement]");
      if (line === null) throw new Error("nothing says anything");
      new MutationObserver(() => words.add(line.textContent ?? "")).observe(line, {
        childList: true,
        characterData: true,
        subtree: true,
      });
      Object.assign(window, { words });
    });
    await Promise.all([
      page().waitForEvent("download", { timeout: 150_000 }),
      page().keyboard.press('"'),
    ]);
    const words = await page().evaluate(() => [
      ...(window as unknown as { words: Set<string> }).words,
    ]);
    for (const part of [1, 2, 3, 4]) {
      expect(words).toContain(`Picture: part ${part} of 4, 192 of 192 samples of light`);
    }
  });

  it("is cancelled by the same key", async () => {
    await stand.open("&mode=traced#v=1&light=many:false");
    await stand.viewer.settled();
    await page().keyboard.press('"');
    await expect.poll(announced).toContain("samples of light");
    await page().keyboard.press('"');
    await expect.poll(announced).toBe("Saving the picture was cancelled.");
  });
});
