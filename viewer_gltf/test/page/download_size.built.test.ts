/**
 * Size of the viewer: its code, and the bytes of a bundle until the overview of all tiles is shown.
 * The bundle is the one in STEREOCELL_TEST_BUNDLE, or the fixture.
 */
import { readdir, readFile } from "node:fs/promises";
import { basename, join } from "node:path";
import { gzipSync } from "node:zlib";
import { describe, expect, it } from "vitest";
import { needsOf } from "../../src/surfaces/required_decoders";
import { describeInChromium } from "../support/browser/skip";
import { DEMO_BUNDLE, DIST, prepareStand, type Stand } from "../support/browser/stand";

const CODE_GZIP_BYTES = 380_000;
const DOCS_WITH_SIZE = [
  "docs/viewer-drawing.md",
  "docs/decisions/static-bundle.md",
  "CHANGELOG.md",
];
/** Bytes of page, code, style and bundle from a host without compression. */
const ON_THE_WIRE_BYTES = 430_000;
/** Bytes for ten tiles, as in the demo. */
const FIRST_PICTURE_BYTES = 300_000;
const DEMO_TILES = 10;
/** Parts of the names of files that are fetched only when needed, after the overview. */
const OPTIONAL = new RegExp(
  [
    "assemble_worker",
    "backdrop",
    "basis",
    "bench",
    "save_picture",
    "card_measure",
    "client_worker",
    "environment_file",
    "explanations",
    "EXRLoader",
    "fflate",
    "frame_port",
    "HDRLoader",
    "inbox",
    "interaction",
    "key_list",
    "keep_offline",
    "address_bar",
    "lens",
    "lost_context",
    "view_sharing",
    "objects",
    "link_of",
    "path_tracer",
    "permalink",
    "qr_scanner",
    "screen_stereo",
    "shading",
    "slices",
    "source[_-]",
    "split_session",
    "placed_card",
    "unclipped",
    "picture_message",
  ].join("|"),
);
const CODE = /\.(js|css|wasm|html)$/;

async function gzipBytes(): Promise<Map<string, number>> {
  const names = await readdir(DIST, { recursive: true });
  const code = names.filter((name) => CODE.test(name));
  const sizes = await Promise.all(
    code.map(async (name) => gzipSync(await readFile(join(DIST, name)), { level: 9 }).length),
  );
  return new Map(code.map((name, i) => [name, sizes[i]]));
}

type Sent = Readonly<{ path: string; bytes: number }>;

/**
 * Returns the files that had been sent when all tiles were on screen: in the first channel
 * (`first`), or in all channels of the opening view (`whole`).
 */
async function sentBefore(
  picture: "first" | "whole",
  stand: Stand,
  query = "",
): Promise<readonly Sent[]> {
  await stand.viewer.page.addInitScript(() => performance.setResourceTimingBufferSize(10_000));
  await stand.viewer.page.goto(`${stand.host.address}/app/?bundle=../bundle/${query}`);
  await stand.viewer.page.waitForFunction(() => window.stereocell !== undefined);
  return stand.viewer.page.evaluate(async (until) => {
    const isFirst = () => {
      try {
        return window.stereocell?.snapshot().hasFirstPicture === true;
      } catch {
        return false; // nothing is open yet
      }
    };
    while (until === "first" && !isFirst()) {
      await new Promise((resolve) => requestAnimationFrame(resolve));
    }
    if (until === "whole") await window.stereocell?.ready;
    const entries = ["navigation", "resource"].flatMap(
      (type) => performance.getEntriesByType(type) as PerformanceResourceTiming[],
    );
    return entries.map(({ name, encodedBodySize }) => ({
      path: new URL(name).pathname,
      bytes: encodedBodySize,
    }));
  }, picture);
}

const sum = (list: readonly Sent[]) => list.reduce((all, { bytes }) => all + bytes, 0);

/** Returns the bytes by kind of file, for readers of the log. */
function table(list: readonly Sent[]): string {
  const kinds = new Map<string, [number, number]>();
  for (const { path, bytes } of list) {
    const kind = basename(path);
    const [count, all] = kinds.get(kind) ?? [0, 0];
    kinds.set(kind, [count + 1, all + bytes]);
  }
  return [...kinds]
    .sort(([, [, a]], [, [, b]]) => b - a)
    .map(([kind, [count, all]]) => `${kind} x ${count}: ${all}`)
    .join(", ");
}

describe("the viewer's code", () => {
  it("is as large as the docs say", async () => {
    for (const name of DOCS_WITH_SIZE) {
      const text = await readFile(new URL(`../../../${name}`, import.meta.url), "utf8");
      const stated = [...text.matchAll(/(.*) (\d+) kB gzip/g)].map(([, before, kB]) => [
        before,
        kB,
      ]);
      const [[before, kB], ...others] = stated;
      expect(before, name).toMatch(/page.* at most$/);
      expect([1000 * Number(kB), others], name).toEqual([CODE_GZIP_BYTES, []]);
    }
  });

  it("without optional parts is at most 380 kB gzip", async () => {
    const sizes = await gzipBytes();
    const needed = [...sizes].filter(([name]) => !OPTIONAL.test(name));
    expect(needed.length).toBeGreaterThan(4); // page, style, main, decoders, workers
    const total = needed.reduce((all, [, bytes]) => all + bytes, 0);
    process.stdout.write(
      `code, gzip: ${total} bytes; optional: ${[...sizes]
        .filter(([name]) => OPTIONAL.test(name))
        .reduce((all, [, bytes]) => all + bytes, 0)}\n`,
    );
    expect(total).toBeLessThanOrEqual(CODE_GZIP_BYTES);
    const main = [...sizes.keys()].find((name) => /viewer-[^/]*\.js$/.test(name)) ?? "";
    // descriptions of the schemas are for readers, and must not be part of the code
    const schema = new URL("../../../schemas/bundle.schema.json", import.meta.url);
    const found = (await readFile(schema, "utf8")).matchAll(/"description": "([^"\\]{40})/g);
    const descriptions = [...found].map(([, description]) => description);
    expect(descriptions.length).toBeGreaterThan(10);
    const code = await readFile(join(DIST, main), "utf8");
    expect(descriptions.filter((description) => code.includes(description))).toEqual([]);
  });
});

describeInChromium("the first picture", () => {
  const stand = prepareStand({
    bundle: DEMO_BUNDLE,
    viewport: { width: 640, height: 360 },
    isBlind: true,
  });

  /** Whether a surface of the overview has Basis Universal textures. */
  async function overviewHasMaps(): Promise<boolean> {
    for (const { tileset } of stand.manifest.channels) {
      if (tileset === null) continue;
      const folder = join(stand.bundle, tileset.path, "..");
      const { root } = JSON.parse(await readFile(join(stand.bundle, tileset.path), "utf8"));
      for (const { content } of root.children) {
        const { buffer, byteOffset, byteLength } = await readFile(join(folder, content.uri));
        const glb = buffer.slice(byteOffset, byteOffset + byteLength) as ArrayBuffer;
        if (needsOf(glb).basis) return true;
      }
    }
    return false;
  }

  it("loads no decoder that it does not use", async () => {
    const sent = await sentBefore("whole", stand, "&mode=off");
    const code = sent.map(({ path }) => path).filter((path) => path.startsWith("/app/assets/"));
    expect(code.some((path) => /\/viewer-.*\.js\.gz$/.test(path))).toBe(true);
    expect(code.filter((path) => /decode_worker/.test(path))).toEqual([]);
    expect(code.some((path) => OPTIONAL.test(path))).toBe(await overviewHasMaps());
  });

  it("comes after at most 300 kB of the bundle, all channels included", async () => {
    const isBundle = ({ path }: Sent) => path.startsWith("/bundle/");
    const first = (await sentBefore("first", stand)).filter(isBundle);
    const share = Math.min(1, stand.manifest.tiles.length / DEMO_TILES);
    const report = `${sum(first)} bytes: ${table(first)}`;
    expect(first.length, report).toBeGreaterThan(1);
    expect(sum(first), report).toBeLessThanOrEqual(share * FIRST_PICTURE_BYTES);
    const whole = (await sentBefore("whole", stand)).filter(isBundle);
    process.stdout.write(`first picture after ${report}\nall channels: ${sum(whole)} bytes\n`);
    expect(sum(whole)).toBeGreaterThan(sum(first));
    expect(sum(whole)).toBeLessThanOrEqual(share * FIRST_PICTURE_BYTES);
  });

  it("comes after at most 430 kB in all, from a host without compression", async () => {
    const sent = await sentBefore("first", stand);
    const report = `${sum(sent)} bytes: ${table(sent)}`;
    process.stdout.write(`on the wire until the first picture: ${report}\n`);
    expect(sent.some(({ path }) => path === "/app/")).toBe(true);
    // scaled to the number of tiles of the demo
    const share = Math.min(1, stand.manifest.tiles.length / DEMO_TILES);
    const ofBundle = sum(sent.filter(({ path }) => path.startsWith("/bundle/")));
    const whole = sum(sent) + (1 / share - 1) * ofBundle;
    expect(whole, report).toBeLessThanOrEqual(ON_THE_WIRE_BYTES);
  });

  it("requests no volume if none is drawn", async () => {
    const sent = await sentBefore("whole", stand, "&mode=off");
    expect(sent.filter(({ path }) => path.includes("/volumes/"))).toEqual([]);
  });
});
