/** The viewer without a bundle: the page itself reads a source at an address, or one that is dropped on it. */
import { mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { afterAll, afterEach, beforeAll, describe, expect, it } from "vitest";
import { Host } from "../support/browser/host";
import { isBackground, takePicture } from "../support/browser/picture";
import { describeInChromium } from "../support/browser/skip";
import { DIST, prepareStand } from "../support/browser/stand";
import { askPython, hasPython } from "../support/python";

const CORS = { "Access-Control-Allow-Origin": "*" };
const T_NOTE = "Only the first of 2 time points is shown.";

describe.skipIf(!hasPython)("without a bundle", () => {
  describeInChromium("the page", () => {
    const stand = prepareStand({ viewport: { width: 480, height: 360 } });
    let folder: string;
    let other: Host;

    beforeAll(async () => {
      folder = await mkdtemp(join(tmpdir(), "stereocell-sources-"));
      await askPython("page_sources", [folder], "");
      other = await Host.start({ "/": folder });
    });

    afterEach(() => other.reset());

    afterAll(async () => {
      await other.stop();
      await rm(folder, { recursive: true, force: true });
    });

    const addressOf = (source: string) =>
      `${stand.host.address}/app/?source=${encodeURIComponent(source)}&view=front&quality=low#v=1&depth=0`;
    const open = (name: string) => stand.viewer.open(addressOf(`${other.address}/${name}`));
    const notices = async () => (await stand.viewer.snapshot()).state.notices;

    async function faultOf(source: string): Promise<string> {
      await stand.viewer.page.goto("about:blank"); // opening the same address again would not load the page
      await stand.viewer.page.goto(addressOf(source));
      const fatal = stand.viewer.page.locator("[data-fatal]");
      const text = (await fatal.textContent({ timeout: 20_000 })) ?? "";
      expect(text).toContain("This source can't be shown");
      return text;
    }

    /** Centres of the pixels of each hue, as shares of the picture. */
    async function middles() {
      const picture = await takePicture(stand.viewer.page);
      const middleOf = (places: [number, number][]) => {
        const sum = places.reduce(([a, b], [x, y]) => [a + x, b + y], [0, 0]);
        return [sum[0] / places.length / picture.width, sum[1] / places.length / picture.height];
      };
      const red = picture.where(([r, g, b]) => r > 60 && r > 2 * g && r > 2 * b);
      const green = picture.where(([r, g, b]) => g > 40 && g > 1.5 * r && g > 1.5 * b);
      return { red, green, atRed: middleOf(red), atGreen: middleOf(green), picture };
    }

    it("shows each channel of OME-Zarr 0.4 in its colour and place", async () => {
      other.headers = CORS;
      await open("v04.ome.zarr");
      await stand.viewer.settled();
      const { state, volumes } = await stand.viewer.snapshot();
      expect(state.notices).toEqual([T_NOTE]);
      expect(state.channels.map(({ name, shown }) => [name, shown])).toEqual([
        ["Left", true],
        ["Right", true],
      ]);
      expect(volumes.length).toBeGreaterThan(0);
      const { red, green, atRed, atGreen, picture } = await middles();
      // The boxes of 16 x 14 um in a field of 28 x 20 um cover only a part of the picture.
      const share = (pixels: readonly unknown[]) =>
        pixels.length / (picture.width * picture.height);
      for (const pixels of [red, green]) {
        expect(share(pixels)).toBeGreaterThan(0.01);
        expect(share(pixels)).toBeLessThan(0.25);
      }
      expect(atRed[0]).toBeLessThan(0.47); // at the lower left
      expect(atRed[1]).toBeGreaterThan(0.53);
      expect(atGreen[0]).toBeGreaterThan(0.53); // at the upper right
      expect(atGreen[1]).toBeLessThan(0.47);
      expect(picture.count((pixel) => !isBackground(pixel))).toBeGreaterThan(500);
    });

    it("has slices and links like a bundle", async () => {
      other.headers = CORS;
      await stand.viewer.open(`${addressOf(`${other.address}/v04.ome.zarr`)}&slices=on`);
      await stand.viewer.settled();
      const { page } = stand.viewer;
      await expect.poll(() => page.locator("[data-slice] canvas").count()).toBe(3);
      const values = page.locator(".slices .values").first();
      await expect.poll(() => values.textContent()).toMatch(/Left.*\d/);
      await stand.viewer.show("Right", false);
      const link = await stand.viewer.writeLink();
      expect(link).toContain("source=");
      await stand.viewer.page.goto("about:blank");
      await stand.viewer.open(link);
      await stand.viewer.settled();
      const { state } = await stand.viewer.snapshot();
      expect(state.channels.map(({ shown }) => shown)).toEqual([true, false]);
      expect(state.notices).toEqual([T_NOTE]);
      const drawn = await middles();
      expect(drawn.red.length).toBeGreaterThan(100); // the 3D view is only a part of the page beside slices
      expect(drawn.green.length).toBe(0);
    });

    it.each(["v05.ome.zarr", "sharded.ome.zarr", "sharded.ozx"])("shows %s", async (name) => {
      other.headers = CORS;
      await open(name);
      await stand.viewer.settled();
      expect(await notices()).toEqual([T_NOTE]);
      const { red, green } = await middles();
      expect(Math.min(red.length, green.length)).toBeGreaterThan(500);
      const data = other.requests.filter(({ path }) => !path.endsWith(".json"));
      // Shards and archives are read in parts, and other chunks whole.
      expect(data.some(({ range }) => range !== null)).toBe(name.startsWith("sharded"));
    });

    it("reads a source on its own host by an address relative to the page", async () => {
      const page = await Host.start({ "/app/": DIST, "/": folder });
      await stand.viewer.open(`${page.address}/app/?source=../v05.ome.zarr&quality=low`);
      expect(await notices()).toEqual([T_NOTE]);
      await page.stop();
    });

    it("contacts only its own host and the host of the source", async () => {
      other.headers = CORS;
      const third = await Host.start({ "/": folder });
      third.headers = CORS;
      await open("v05.ome.zarr");
      const reach = (address: string) =>
        stand.viewer.page.evaluate(
          (url) =>
            fetch(url).then(
              ({ ok }) => ok,
              () => false,
            ),
          `${address}/v05.ome.zarr/zarr.json`,
        );
      expect(await reach(other.address)).toBe(true);
      expect(await reach(third.address)).toBe(false);
      expect(third.requests).toEqual([]);
      await third.stop();
      const asked = await stand.viewer.page.evaluate(
        () => navigator.serviceWorker?.controller ?? null,
      );
      expect(asked).toBeNull();
    });

    describe("names the remedy if", () => {
      it("the host allows no other page", async () => {
        const text = await faultOf(`${other.address}/v04.ome.zarr`);
        const { origin } = new URL(stand.host.address);
        expect(text).toContain(
          "does not let other pages read its files. Ask the operator of the host to",
        );
        expect(text).toContain(`Access-Control-Allow-Origin: ${origin}`);
      });

      it.each(["sharded.ome.zarr", "sharded.ozx"])("the host sends no parts: %s", async (name) => {
        other.headers = CORS;
        other.hasRanges = false;
        const text = await faultOf(`${other.address}/${name}`);
        expect(text).toContain("does not send parts of files");
        expect(text).toContain("Ask the operator of the host to turn on HTTP range requests");
      });

      it("a codec is unknown, a file is damaged, or there is no image", async () => {
        other.headers = CORS;
        const path = "/v05.ome.zarr/0/zarr.json";
        const metadata = await readFile(join(folder, path), "utf8");
        const renamed = metadata.replace('"gzip"', '"secret_codec"');
        other.overrides.set(path, { status: 200, body: renamed });
        const unknown = await faultOf(`${other.address}/v05.ome.zarr`);
        expect(unknown).toContain(
          "found voxels packed by secret_codec, expected blosc, zstd, gzip or lz4",
        );
        other.overrides.clear();

        other.overrides.set("/v05.ome.zarr/0/c/0/0/0/0/0", { status: 200, body: "no gzip" });
        expect(await faultOf(`${other.address}/v05.ome.zarr`)).toContain(
          "found a chunk that gzip can't unpack",
        );
        other.overrides.clear();

        other.overrides.set("/v05.ome.zarr/zarr.json", { status: 200, body: "<html>" });
        expect(await faultOf(`${other.address}/v05.ome.zarr`)).toContain("Failed to decode JSON");
        other.overrides.clear();

        const level = await faultOf(`${other.address}/v05.ome.zarr/0`);
        expect(level).toContain("found a Zarr array, expected the group of an OME-Zarr image");
        const nothing = await faultOf(`${other.address}/nothing.zarr`);
        expect(nothing).toMatch(/found neither zarr.json|does not let other pages/);
        const file = await faultOf(`${other.address}/cells.ome.tif`);
        expect(file).toMatch(/use stereocell view http:.*cells\.ome\.tif|let other pages/);
        expect(await faultOf(`${other.address}/nothing.ozx`)).toMatch(/not found|let other pages/);
      });

      it("the host can't be reached, or the address is invalid", async () => {
        expect(await faultOf("http://127.0.0.1:9/x.zarr")).toContain("can't be reached");
        const { page } = stand.viewer;
        await page.goto(`${stand.host.address}/app/?source=file%3A%2F%2F%2Fetc%2Fpasswd`);
        const fatal = (await page.locator("[data-fatal]").textContent()) ?? "";
        expect(fatal).toContain("expected an image's address on the web");
        expect(fatal).toContain("This source can't be shown");
        await page.goto(`${stand.host.address}/app/?source=x.zarr&bundle=../bundle/`);
        expect(await page.locator("[data-fatal]").textContent()).toContain("are both given");
      });
    });

    it("shows a source to each eye of the split screen", async () => {
      other.headers = CORS;
      await open("v04.ome.zarr");
      await stand.viewer.page.keyboard.press("P");
      await expect.poll(async () => (await stand.viewer.snapshot()).isStereo).toBe(true);
      const half = { y: 0, width: 240, height: 360 };
      const isRed = ([r, g, b]: readonly number[]) => r > 60 && r > 2 * g && r > 2 * b;
      for (const x of [0, 240]) {
        const eye = async () => (await takePicture(stand.viewer.page, { x, ...half })).count(isRed);
        await expect.poll(eye, { timeout: 20_000 }).toBeGreaterThan(200);
      }
    });

    describe("opens a source of this device", () => {
      const start = async () => {
        await stand.viewer.page.goto(
          `${stand.host.address}/app/?view=front&quality=low#v=1&depth=0`,
        );
        await stand.viewer.page.locator("[data-start-page]").waitFor();
        stand.host.requests.length = 0;
      };
      const shown = async () => {
        const { page } = stand.viewer;
        const status = page.locator("[data-source-status]");
        await expect.poll(() => status.count(), { timeout: 20_000 }).toBe(0);
        await page.evaluate(() => window.stereocell?.ready);
        return stand.viewer.snapshot();
      };
      /** Requests for anything but the viewer's own parts. */
      const asked = () =>
        stand.host.requests.filter(({ path }) => !/^\/app\/(assets|environments)\//.test(path));

      it("from a dropped NIfTI file, and sends none of its data", async () => {
        const bytes = [...(await readFile(join(folder, "head.nii.gz")))];
        await start();
        await stand.viewer.page.evaluate((content) => {
          const data = new DataTransfer();
          data.items.add(new File([Uint8Array.from(content)], "Jane Doe.nii.gz"));
          dispatchEvent(new DragEvent("drop", { dataTransfer: data, bubbles: true }));
        }, bytes);
        const { state, volumes } = await shown();
        expect(state.channels.map(({ name }) => name)).toEqual(["NIfTI"]);
        expect(volumes.length + Number(state.mode === "traced")).toBeGreaterThan(0);
        expect(await stand.viewer.page.title()).toBe("NIfTI · StereoCell");
        expect(asked()).toEqual([]);
      });

      it("from a dropped folder of OME-Zarr, and others that are dropped on the view", async () => {
        await start();
        const { page } = stand.viewer;
        const devtools = await page.context().newCDPSession(page);
        const drop = async (name: string) => {
          const data = { items: [], files: [join(folder, name)], dragOperationsMask: 1 };
          for (const type of ["dragEnter", "dragOver", "drop"] as const) {
            await devtools.send("Input.dispatchDragEvent", { type, x: 100, y: 100, data });
          }
        };
        await drop("sharded.ome.zarr");
        const { state } = await shown();
        expect(state.channels.map(({ name }) => name)).toEqual(["Left", "Right"]);
        expect(asked()).toEqual([]);
        await drop("head.nii.gz");
        const names = async () => (await stand.viewer.snapshot()).state.channels.map((c) => c.name);
        await expect.poll(names).toEqual(["NIfTI"]);
        expect(await page.locator("#app main.view").count()).toBe(1);

        await writeFile(join(folder, "notes.txt"), "no image");
        await drop("notes.txt");
        await expect.poll(async () => (await notices()).join()).toContain("notes.txt: found");
        expect(await names()).toEqual(["NIfTI"]);
      });

      it("from a chosen folder of OME-Zarr", async () => {
        await start();
        const field = stand.viewer.page.locator('[data-choose="folder"]');
        await field.setInputFiles(join(folder, "v04.ome.zarr"));
        const { state } = await shown();
        expect(state.channels.map(({ name }) => name)).toEqual(["Left", "Right"]);
        expect(asked()).toEqual([]);
      });

      it("after a file that could not be read", async () => {
        await writeFile(join(folder, "notes.txt"), "no image");
        await start();
        const field = stand.viewer.page.locator('[data-choose="file"]');
        await field.setInputFiles(join(folder, "notes.txt"));
        const status = stand.viewer.page.locator("[data-source-status]");
        await expect
          .poll(() => status.textContent())
          .toContain("notes.txt: found another format, expected NIfTI");
        await field.setInputFiles(join(folder, "sharded.ozx"));
        expect((await shown()).state.channels.length).toBe(2);
      });
    });
  });
});
