/** The inbox: files are dropped, uploaded despite faults, recognised, previewed, built and deleted. */
import { createHash } from "node:crypto";
import { mkdir, mkdtemp, readdir, readFile, rm, stat, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import axe from "axe-core";
import type { Page } from "playwright-core";
import { afterAll, afterEach, beforeAll, beforeEach, expect, it } from "vitest";
import { openBrowser } from "../support/browser/shared_browser";
import { describeInChromium } from "../support/browser/skip";
import { DIST } from "../support/browser/stand";
import { drop } from "../support/inbox/drop";
import { FakeInbox } from "../support/inbox/fake_inbox";

const KB = 1000;
/** A DICOM series on a disk, with files that an operating system leaves beside it. */
const FILES = [
  ...Array.from({ length: 40 }, (_, i) => `series/${String(i).padStart(3, "0")}.dcm`),
  "series/deep/last.dcm",
  "series/.DS_Store",
];
const BYTES = 50 * KB;
const TOTAL = 41 * BYTES;

const UNDERSTOOD = {
  ...{ format: "DICOM", title: "Head", modality: "MR", size_text: "18.2 x 20.1 x 15.0 cm" },
  ...{ size_voxels: [256, 256, 180], spacing_um: [700, 700, 800], tiles: 2, bytes_estimate: 31e6 },
  notes: ["<b>bold</b>: the spacing of slices follows from their positions."],
  channels: [
    { id: "0", name: "T1", color: "#ffcc88", has_surface: true, level: 162, unit: "" },
    { id: "1", name: "T2", color: "#88ccff", has_surface: false, level: null, unit: "" },
  ],
  slices: ["z", "y", "x"].map((axis) => ({ axis, name: axis, image: `slices/${axis}.png` })),
  choices: {
    preset: { value: "mri", options: ["mri", "ct", "vessels"] },
    channels: {
      value: ["0", "1"],
      options: [
        { id: "0", name: "T1" },
        { id: "1", name: "T2" },
      ],
    },
    series: null,
    background: null,
  },
};

describeInChromium("the inbox", () => {
  let folder: string;
  let server: FakeInbox;
  let browser: Awaited<ReturnType<typeof openBrowser>>;
  let page: Page;
  const faults: string[] = [];

  beforeAll(async () => {
    folder = await mkdtemp(join(tmpdir(), "stereocell-inbox-"));
    await mkdir(join(folder, "series", "deep"), { recursive: true });
    for (const [i, name] of FILES.entries()) {
      const content = Buffer.alloc(BYTES).map((_, at) => (at * 31 + i * 17) % 253);
      await writeFile(join(folder, name), content);
    }
    server = await FakeInbox.start(DIST);
    server.understood = UNDERSTOOD;
    browser = await openBrowser({ viewport: { width: 1000, height: 700 }, pixelRatio: 1 });
  });

  beforeEach(async () => {
    faults.length = 0;
    page = await browser.context.newPage();
    page.on("pageerror", ({ message }) => faults.push(message));
    page.on("console", (message) => {
      if (/content.security.policy/i.test(message.text())) faults.push(message.text());
    });
    page.on("dialog", (dialog) => void dialog.accept()); // leaving the page ends an upload
    await page.goto(server.address);
  });

  afterEach(async () => {
    await page.close({ runBeforeUnload: false });
    server.reset();
  });

  afterAll(async () => {
    await browser?.close();
    await server?.stop();
    await rm(folder, { recursive: true, force: true });
  });

  const card = () => page.locator("article").first();
  const words = () => card().locator("[data-words]");
  const press = (action: string) => card().locator(`[data-action="${action}"]`).click();
  const expectWords = (pattern: RegExp) =>
    expect.poll(() => words().textContent()).toMatch(pattern);
  const only = () => server.items[0];
  const hashOf = (bytes: Buffer) => createHash("sha256").update(bytes).digest("hex");

  async function wholeHash(): Promise<string> {
    const names = FILES.filter((name) => !name.endsWith(".DS_Store")).sort();
    const contents = await Promise.all(names.map((name) => readFile(join(folder, name))));
    return hashOf(Buffer.concat(contents));
  }

  async function findings(): Promise<readonly string[]> {
    await page.evaluate(axe.source); // the page's policy forbids scripts from other sources
    const { violations } = await page.evaluate(() =>
      window.axe.run({
        runOnly: { type: "tag", values: ["wcag2a", "wcag2aa", "wcag21aa", "best-practice"] },
        resultTypes: ["violations"],
      }),
    );
    return violations.flatMap(({ id, nodes }) => nodes.map(({ html }) => `${id}: ${html}`));
  }

  it("is a small page that loads only its own files", async () => {
    const html = await readFile(join(DIST, "inbox.html"), "utf8");
    const [, policy] = /http-equiv="Content-Security-Policy"\s+content="([^"]*)"/.exec(html) ?? [];
    expect(policy.split("; ").sort()).toEqual([
      ...["base-uri 'none'", "connect-src 'self'", "default-src 'none'", "form-action 'none'"],
      ...["img-src 'self'", "script-src 'self'", "style-src 'self'"],
    ]);
    const linked = [...html.matchAll(/(?:src|href)="\.\/([^"]+)"/g)].map(([, path]) => path);
    expect(linked.every((path) => /^(inbox_assets\/|icon\.svg$)/.test(path))).toBe(true);
    const code = await readdir(join(DIST, "inbox_assets"));
    const sizes = await Promise.all(
      code.map(async (name) => (await stat(join(DIST, "inbox_assets", name))).size),
    );
    expect(Math.max(...sizes)).toBeLessThan(100 * KB); // three alone has 700 kB
    const worker = await readFile(join(DIST, "sw.js"), "utf8");
    expect(worker).not.toContain("inbox"); // the viewer does not keep it for use offline
  });

  it("receives a complete folder, although the connection breaks twice and the page is reloaded", async () => {
    server.cuts.push(700 * KB + 7, 1200 * KB + 1);
    server.delay_ms = 150;
    await drop(page, join(folder, "series"));
    await expect.poll(() => only()?.bytes).toBeGreaterThan(1200 * KB);
    expect(server.cuts).toEqual([]);
    expect(await card().locator("h2").textContent()).toBe("series");
    await page.reload();
    await expectWords(/have arrived\. Drop the same files again to continue/);
    const before = Number(only().bytes);
    expect(before).toBeLessThan(TOTAL);
    server.delay_ms = 0;
    await drop(page, join(folder, "series"));
    await expect.poll(() => only().doing).toBe("understood");
    const { id } = only();
    expect(server.items).toHaveLength(1);
    expect(hashOf(server.arrived.get(id) as Buffer)).toBe(await wholeHash());
    expect(server.lists.get(id)?.at(-1)).toEqual(["series/deep/last.dcm", BYTES]);
    await expectWords(/Open a preview/);
    expect(faults).toEqual([]);
  });

  it("names a file that changes on the disk during the upload, and does not send it", async () => {
    server.delay_ms = 150;
    await drop(page, join(folder, "series"));
    await expect.poll(() => only()?.bytes).toBeGreaterThan(300 * KB);
    const last = join(folder, "series/039.dcm");
    const content = await readFile(last);
    await writeFile(last, Buffer.alloc(3 * BYTES));
    await expectWords(/^series\/039\.dcm has changed or is gone\. Drop the files again\.$/);
    await writeFile(last, content);
    expect(only().bytes).toBeLessThanOrEqual(39 * BYTES);
  });

  it("continues with one click after a reload if the browser has kept the folder", async () => {
    server.delay_ms = 150;
    await drop(page, join(folder, "series"));
    await expect.poll(() => only()?.bytes).toBeGreaterThan(300 * KB);
    await page.reload();
    server.delay_ms = 0;
    await press("go-on");
    await expect.poll(() => only().doing).toBe("understood");
    expect(hashOf(server.arrived.get(only().id) as Buffer)).toBe(await wholeHash());
    expect(faults).toEqual([]);
  });

  it("shows what it recognised, accepts settings, opens the preview, and builds", async () => {
    await page.setInputFiles('[data-choose="files"]', join(folder, "series/001.dcm"));
    await expect.poll(() => card().locator("figure img").count()).toBe(3);
    expect(await findings()).toEqual([]);
    const { id } = only();
    // A name or a note is never interpreted as markup.
    expect(await card().locator("li").textContent()).toContain("<b>bold</b>");
    expect(await card().locator("dd").allTextContents()).toEqual([
      ...["DICOM, MR", "18.2 × 20.1 × 15.0 cm", "256 × 256 × 180", "0.7 × 0.7 × 0.8 mm"],
      "2 tiles, about 31 MB",
    ]);

    server.understood = { ...UNDERSTOOD, size_text: "other" };
    await card().getByLabel("Kind of image").selectOption({ label: "CT: skin" });
    await expect.poll(() => card().locator("dd").allTextContents()).toContain("other");
    await card().getByLabel("T2").uncheck();
    await card().getByLabel("T1").click();
    expect(await card().getByLabel("T1").isChecked()).toBe(true); // at least one channel stays selected
    await expect.poll(() => server.requests.length).toBe(3);
    expect(server.requests.slice(1)).toEqual([
      `PUT items/${id}/choices {"preset":"ct"}`,
      `PUT items/${id}/choices {"channels":["0"]}`,
    ]);

    const [tab] = await Promise.all([page.waitForEvent("popup"), press("look")]);
    await tab.waitForURL(`**/items/${id}/view/`);
    await tab.close();

    await card().getByText("Keep the upload after the build").click();
    await press("build");
    await expect
      .poll(() => server.requests.at(-1))
      .toBe(`POST items/${id}/build {"keep_upload":true}`);
    server.change(id, { doing: "queued", place: 2 });
    await expectWords(/after 1 other/);
    const building = { doing: "building", place: 0, label: "units", share: 0.25, tiles: 1 };
    server.change(id, { ...building, all_tiles: 4, left_s: 30 });
    await expectWords(/^Building surfaces: 1 of 4 tiles, about 30 s left/);
    expect(await card().locator("progress").getAttribute("value")).toBe("0.25");
    await press("pause");
    await expect.poll(() => server.requests.at(-1)).toBe(`POST items/${id}/pause`);
    server.change(id, { doing: "built", page: `items/${id}/view/` });
    await expectWords(/^All surfaces are built/);
    const open = card().getByRole("link", { name: "Open" });
    expect(await open.getAttribute("href")).toBe(`items/${id}/view/`);
    expect(await page.locator("[data-aloud]").textContent()).toMatch(/All surfaces are built/);

    await press("delete");
    const dialog = page.getByRole("dialog");
    expect(await dialog.textContent()).toContain("the built specimen, with its page");
    await page.keyboard.press("Escape");
    expect(server.items).toHaveLength(1);
    await press("delete");
    await dialog.getByRole("button", { name: "Delete" }).click();
    await expect.poll(() => page.locator("article").count()).toBe(0);
    expect(server.requests.at(-1)).toBe(`DELETE items/${id}`);
    expect(faults).toEqual([]);
  });

  it("accepts an address, and shows why the server refuses it", async () => {
    await page.getByLabel("Or paste an address").fill("https://host/a.ome.zarr");
    await page.keyboard.press("Enter");
    await expect
      .poll(() => server.requests)
      .toEqual(['POST items {"address":"https://host/a.ome.zarr"}']);
    await expectWords(/is being read/);
    expect(await page.getByLabel("Or paste an address").inputValue()).toBe("");
    server.change(only().id, { doing: "failed", line: "https://host/a.ome.zarr: not found" });
    await expectWords(/^https:\/\/host\/a\.ome\.zarr: not found$/);
    server.change(only().id, { line: "no voxel size: state it", asks: "spacing_um" });
    const asked = card().getByRole("form", { name: "Voxel spacing" });
    for (const [axis, length] of ["0,5", "0.5", "2"].entries()) {
      await asked.getByRole("textbox").nth(axis).fill(length);
    }
    await page.keyboard.press("Enter");
    await expect
      .poll(() => server.requests.at(-1))
      .toBe(`PUT items/${only().id}/choices {"spacing_um":[0.5,0.5,2]}`);
  });

  it("shows everything to users with read access only, also on a phone", async () => {
    const { id } = { id: "a1" };
    const rest = { line: "", bytes: 1, total: 1, label: "", page: `items/${id}/view/` };
    server.items = [{ ...rest, id, doing: "built", title: "x".repeat(120) }];
    server.mayUpload = false;
    server.report();
    await page.setViewportSize({ width: 360, height: 640 });
    await expectWords(/^All surfaces/);
    expect(await page.getByRole("button").count()).toBe(0);
    expect(await page.getByLabel("Or paste an address").isVisible()).toBe(false);
    expect(await card().getByRole("link", { name: "Open" }).isVisible()).toBe(true);
    const isWide = () => {
      const { scrollWidth, clientWidth } = document.documentElement;
      return scrollWidth > clientWidth;
    };
    expect(await page.evaluate(isWide)).toBe(false);
    expect(await findings()).toEqual([]);
    await page.emulateMedia({ colorScheme: "light" });
    expect(await findings()).toEqual([]);
  });
});
