import { mkdtemp, readFile, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { afterAll, afterEach, beforeAll, beforeEach, describe, expect, it, vi } from "vitest";
import { writeFixture } from "../../test/support/fixture/bundle";
import { BASE, type FolderHost, folderHost, WorkerStub } from "../../test/support/fixture/unit";
import type { Manifest } from "../bundle/generated/bundle";
import type { TileVolume } from "../bundle/generated/volumes";
import { LoadQueue } from "./load_queue";
import { texels } from "./mip_levels";
import { LEVEL_FADE_S, TileTexture } from "./tile_texture";
import { VolumeSource } from "./volume_source";

describe("the texture of a tile", { timeout: 120_000 }, () => {
  let folder: string;
  let manifest: Manifest;
  let volumes: ReadonlyMap<string, TileVolume>;
  let host: FolderHost;
  let texture: TileTexture;
  const faults: unknown[] = [];

  beforeAll(async () => {
    folder = await mkdtemp(join(tmpdir(), "stereocell-texture-"));
    manifest = await writeFixture(folder);
    const first = manifest.channels.map(async ({ id, volumes: { path } }) => {
      const list = JSON.parse(await readFile(join(folder, path), "utf8"));
      return [id, list.volumes[0]] as const;
    });
    volumes = new Map(await Promise.all(first));
  }, 120_000);
  afterAll(() => rm(folder, { recursive: true, force: true }));

  beforeEach(() => {
    faults.length = 0;
    host = folderHost(folder, new Map());
    vi.stubGlobal("fetch", host.fetch);
    vi.stubGlobal("Worker", WorkerStub);
    texture = new TileTexture(
      new LoadQueue(4),
      () => undefined,
      (error) => faults.push(error),
    );
  });
  afterEach(() => {
    texture.dispose();
    expect(faults).toEqual([]);
    vi.unstubAllGlobals();
  });

  const sourcesOf = (...ids: readonly string[]) =>
    new Map(
      ids.map((id) => {
        const volume = volumes.get(id);
        if (volume === undefined) throw new Error(`there is no volume of ${id}`);
        return [id, new VolumeSource(BASE, volume)] as const;
      }),
    );
  const isAt = (level: number | undefined) =>
    vi.waitFor(
      () => {
        expect(texture.isLoading).toBe(false);
        expect(texture.shown?.level).toBe(level);
      },
      { timeout: 30_000 },
    );
  const bytesOf = (level: number, stride: number) => {
    const [volume] = volumes.values();
    if (volume === undefined) throw new Error("the fixture has no volume");
    return stride * texels(volume.levels[level]);
  };

  it("is loaded coarse first, each level once", async () => {
    texture.want(sourcesOf("Balls"), [3, 2, 1, 0]);
    await isAt(0);
    const levels = volumes.get("Balls")?.levels ?? [];
    const ranges = host.asked.flatMap(({ range }) => range ?? []);
    expect(ranges).toEqual(
      [3, 2, 1, 0].map((i) => {
        const { offset, length } = levels[i];
        return `bytes=${offset}-${offset + length - 1}`;
      }),
    );
  });

  it("shows its first level at once, and fades from each level to the next", async () => {
    const sources = sourcesOf("F_x20_body", "Balls", "Block");
    texture.want(sources, [2]);
    await isAt(2);
    expect(texture.fresh).toBe(1);
    expect(texture.old).toBeNull();
    expect(texture.bytes).toBe(bytesOf(2, 4));
    expect(texture.advance(1)).toBe(false);

    const before = texture.shown;
    const dropped = vi.fn();
    before?.texture.addEventListener("dispose", dropped);
    texture.want(sources, [2, 1]);
    await isAt(1);
    expect(texture.old).toBe(before);
    expect(texture.fresh).toBe(0); // the next frame looks like the last one
    expect(texture.bytes).toBe(bytesOf(2, 4) + bytesOf(1, 4));
    const shares: number[] = [];
    for (let i = 0; i < 4; i++) {
      expect(texture.advance(LEVEL_FADE_S / 4 + 1e-9)).toBe(i < 3);
      shares.push(texture.fresh);
      expect(dropped).toHaveBeenCalledTimes(i < 3 ? 0 : 1);
    }
    [0.25, 0.5, 0.75, 1].forEach((share, i) => {
      expect(shares[i]).toBeCloseTo(share, 6);
    });
    expect(texture.old).toBeNull();
    expect(texture.bytes).toBe(bytesOf(1, 4));
  });

  it("is replaced by a coarser level if there is less room", async () => {
    const sources = sourcesOf("Balls");
    texture.want(sources, [1, 0], 0);
    await isAt(0);
    texture.advance(1);
    expect(texture.bytes).toBe(bytesOf(0, 1));
    texture.want(sources, [1], 1);
    await isAt(1);
    texture.advance(1);
    expect(texture.bytes).toBe(bytesOf(1, 1));
  });

  it("stays as it is while no finer level is wanted", async () => {
    const sources = sourcesOf("Balls");
    texture.want(sources, [1, 0], 0);
    await isAt(0);
    texture.advance(1);
    const asked = host.asked.length;
    // The gaze wanders, so no finer level is loaded and none is dropped.
    texture.want(sources, [1], 0);
    await isAt(0);
    expect(host.asked.length).toBe(asked);
  });

  it("shows another set of channels at once, from loaded levels", async () => {
    const sources = sourcesOf("Balls", "Block");
    texture.want(sources, [1, 0]);
    await isAt(0);
    texture.advance(1);
    const asked = host.asked.length;
    const left = new Map([...sources].slice(0, 1));
    texture.want(left, [1, 0]);
    await vi.waitFor(() => expect(texture.shown?.channels).toEqual(["Balls"]));
    await isAt(0);
    expect(texture.old).toBeNull();
    expect(texture.bytes).toBe(bytesOf(0, 1));
    expect(host.asked.length).toBe(asked);
  });
});
