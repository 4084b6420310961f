/** Memory after many changes of tile equals the memory after all tiles were shown once. */
import { expect, it } from "vitest";
import { describeInChromium } from "../support/browser/skip";
import { DEMO_BUNDLE, prepareStand } from "../support/browser/stand";

const SWITCHES = 10;
/** Time without a change after which the number of objects counts as final. */
const STABLE_MS = 1000;
/** Bytes of JavaScript heap for compiled code and the driver's own handles; a volume takes more. */
const HEAP_SLACK_BYTES = 2 * 1024 * 1024;
/** Timer queries are not counted, because a few are always pending. */
const KINDS = [
  "Texture",
  "Buffer",
  "Program",
  "Shader",
  "Framebuffer",
  "Renderbuffer",
  "VertexArray",
  "Sampler",
] as const;
type Counts = Record<(typeof KINDS)[number], number>;

/** Counts objects that are made and not deleted, from before the page's own scripts run. */
function countGpuObjects(kinds: readonly string[]): void {
  const counts: Record<string, number> = Object.fromEntries(kinds.map((kind) => [kind, 0]));
  (window as unknown as { gpuObjects: Record<string, number> }).gpuObjects = counts;
  type Call = (this: unknown, object?: object | null) => object | null;
  const calls = WebGL2RenderingContext.prototype as unknown as Record<string, Call>;
  for (const kind of kinds) {
    const live = new WeakSet<object>();
    const [make, drop] = [calls[`create${kind}`], calls[`delete${kind}`]];
    calls[`create${kind}`] = function (argument) {
      const made = make.call(this, argument);
      if (made !== null) {
        live.add(made);
        counts[kind]++;
      }
      return made;
    };
    calls[`delete${kind}`] = function (object) {
      if (object && live.delete(object)) counts[kind]--;
      return drop.call(this, object);
    };
  }
}

describeInChromium("changing tiles", () => {
  const stand = prepareStand({
    bundle: DEMO_BUNDLE,
    viewport: { width: 320, height: 240 },
  });

  it("leaks neither GPU objects nor memory", async () => {
    const { page } = stand.viewer;
    await page.addInitScript(countGpuObjects, [...KINDS]);
    await stand.open("&mode=tile&switch=9");
    await stand.viewer.settled();
    for (const { id } of stand.manifest.channels.slice(0, 2)) {
      await stand.viewer.drawVolume(id, true);
    }
    const counts = () =>
      page.evaluate(() => ({ ...(window as unknown as { gpuObjects: Counts }).gpuObjects }));
    const devtools = await page.context().newCDPSession(page);
    const heapBytes = async () => {
      await devtools.send("HeapProfiler.collectGarbage");
      return (await devtools.send("Runtime.getHeapUsage")).usedSize;
    };

    // More tiles than are kept for a while, if the bundle has them, so that some are removed.
    const tiles = stand.manifest.tiles.slice(0, 5).map(({ id }) => id);
    const show = async (n: number) => {
      for (let i = 0; i < n; i++) await stand.viewer.chooseTile(tiles[i % tiles.length]);
      await stand.viewer.still();
    };
    // Each tile is shown twice, so that every shader was used with every surface.
    await show(2 * tiles.length);
    const { volumes } = await stand.viewer.snapshot();
    expect(volumes.map(({ tile }) => tile)).toContain(tiles[tiles.length - 1]);
    // objects of a busy worker are made and released a moment later
    let first = await counts();
    await expect
      .poll(async () => {
        const earlier = first;
        await page.waitForTimeout(STABLE_MS);
        first = await counts();
        return KINDS.every((kind) => first[kind] === earlier[kind]);
      })
      .toBe(true);
    const firstBytes = await heapBytes();
    expect(first.Texture).toBeGreaterThan(0);
    expect(first.Buffer).toBeGreaterThan(0);
    await show(SWITCHES);
    await expect.poll(counts).toEqual(first); // a leak would stay
    expect(await heapBytes()).toBeLessThan(firstBytes + HEAP_SLACK_BYTES);
  });

  it("releases the memory of a channel that is shown and hidden repeatedly", async () => {
    const { page } = stand.viewer;
    await page.addInitScript(countGpuObjects, [...KINDS]);
    await stand.open("&mode=off");
    await stand.viewer.settled();
    const counts = () =>
      page.evaluate(() => ({ ...(window as unknown as { gpuObjects: Counts }).gpuObjects }));
    const [{ id }] = stand.manifest.channels;
    const blink = async (n: number) => {
      for (let i = 0; i < n; i++) {
        await stand.viewer.show(id, false);
        await stand.viewer.show(id, true);
      }
      await stand.viewer.still();
    };
    await blink(2);
    const first = await counts();
    await blink(4);
    await expect.poll(counts).toEqual(first);
  });
});
