/** The memory budget of all volumes together, for any set of wanted volumes. */
import { mkdtemp, readFile, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { DepthTexture } from "three";
import { afterAll, afterEach, beforeAll, beforeEach, describe, expect, it, vi } from "vitest";
import { writeFixture } from "../../test/support/fixture/bundle";
import { BASE, folderHost, WorkerStub } from "../../test/support/fixture/unit";
import type { Manifest } from "../bundle/generated/bundle";
import type { TileVolume } from "../bundle/generated/volumes";
import { initialState } from "../state/initial_state";
import { reduce } from "../state/reduce";
import { NO_FOCUS, wantedTiles } from "../state/representation";
import type { ViewerState } from "../state/viewer_state";
import { makeFrame } from "../voxels/march_frame";
import { texels } from "../voxels/mip_levels";
import { stride } from "../voxels/volume_texture";
import { VolumeSet } from "./volume_set";

const TILES = 6;
const SIDE = 2048;
/** The set leaves room for this number of tiles that were looked at before. */
const KEPT_TILES = 2;
/** While a level fades in, the previous one, an eighth as large, is kept too. */
const FADING = 9 / 8;

describe("the memory of the volumes", { timeout: 120_000 }, () => {
  let folder: string;
  let manifest: Manifest;
  /** The fixture's first volume represents all: four channels in six tiles. */
  let volume: TileVolume;
  let lists: Map<string, string>;
  const faults: unknown[] = [];
  let set: VolumeSet;

  beforeAll(async () => {
    folder = await mkdtemp(join(tmpdir(), "stereocell-volumes-"));
    const fixture = await writeFixture(folder);
    const [channel] = fixture.channels;
    const list = JSON.parse(await readFile(join(folder, channel.volumes.path), "utf8"));
    volume = list.volumes[0];
    const ids = Array.from({ length: TILES }, (_, i) => `r0_c${i}`);
    const text = JSON.stringify({ volumes: ids.map((tile) => ({ ...volume, tile })) });
    lists = new Map([["volumes.json", text]]);
    const [first, ...others] = ids.map((id) => ({ ...fixture.tiles[0], id }));
    // The test has no secure context, so no hash is checked.
    const volumes = { path: "volumes.json", bytes: text.length, sha256: "" };
    manifest = {
      ...fixture,
      tiles: [first, ...others],
      channels: ["A", "B", "C", "D"].map((id) => ({ ...channel, id, volumes })),
    };
  }, 120_000);
  afterAll(() => rm(folder, { recursive: true, force: true }));

  beforeEach(() => {
    faults.length = 0;
    vi.stubGlobal("fetch", folderHost(folder, lists).fetch);
    vi.stubGlobal("Worker", WorkerStub);
  });
  afterEach(() => {
    set.dispose();
    expect(faults).toEqual([]);
    vi.unstubAllGlobals();
  });

  function makeSet(budget: number): void {
    const onError = (error: unknown) => faults.push(error);
    const limits = { bytes: budget, side: SIDE, edge: Number.POSITIVE_INFINITY };
    const frame = makeFrame(new DepthTexture(1, 1));
    set = new VolumeSet({ base: BASE, manifest }, frame, limits, () => undefined, onError);
  }

  /**
   * Follows the state until everything is loaded and faded in. Returns the largest number of bytes
   * on the way.
   */
  async function sync(state: ViewerState, tiles: readonly string[]): Promise<number> {
    const wanted = wantedTiles(state, { ...NO_FOCUS, focusTile: tiles[0], near: new Set(tiles) });
    set.sync(state, wanted, true);
    let most = set.bytes;
    await vi.waitFor(
      () => {
        most = Math.max(most, set.bytes);
        const isFading = set.advance(0.05);
        expect(set.isLoading || isFading).toBe(false);
        expect(set.status().every(({ level }) => level !== null)).toBe(true);
      },
      { timeout: 60_000, interval: 1 },
    );
    return Math.max(most, set.bytes);
  }

  const all = () => manifest.tiles.map(({ id }) => id);
  const opened = (mode: ViewerState["mode"]) =>
    reduce(initialState(manifest), { type: "set", id: "mode", value: mode });
  const levelsNow = () => new Set(set.status().map(({ level }) => level));
  const coarsestNow = () => Math.max(...set.status().map(({ level }) => level ?? 0));
  const bytesOf = (level: number, channels: number) =>
    texels(volume.levels[level]) * stride(channels);

  it.each([0, 1, 2, 3])(
    "stays within the budget for four channels in all tiles, at level %i",
    async (level) => {
      const state = opened("all");
      expect(state.channels.filter(({ shown }) => shown)).toHaveLength(4);
      const budget = FADING * (TILES + KEPT_TILES) * bytesOf(level, 4);
      makeSet(budget);
      const most = await sync(state, all());
      expect(set.status()).toHaveLength(4 * TILES);
      expect(levelsNow()).toEqual(new Set([level])); // the finest level that fits
      expect(set.bytes).toBe(TILES * bytesOf(level, 4));
      expect(most).toBeLessThanOrEqual(budget);
      if (level === 3) return; // the coarsest level is always loaded
      set.dispose();
      makeSet(budget / 2);
      expect(await sync(state, all())).toBeLessThanOrEqual(budget / 2);
      expect(levelsNow()).toEqual(new Set([level + 1]));
    },
  );

  it("needs a new march in each step of a fade, and none when everything has faded in", async () => {
    makeSet(FADING * (TILES + KEPT_TILES) * bytesOf(1, 4));
    const state = opened("all");
    const [tile] = all();
    set.sync(
      state,
      wantedTiles(state, { ...NO_FOCUS, focusTile: tile, near: new Set([tile]) }),
      true,
    );
    const keys: string[] = [];
    await vi.waitFor(
      () => {
        const before = [tile, ...all()].map((id) => set.presence(id, "A")).join();
        const isFading = set.advance(0.05);
        const after = [tile, ...all()].map((id) => set.presence(id, "A")).join();
        if (after !== before) keys.push(set.marchKey);
        expect(set.isLoading || isFading).toBe(false);
      },
      { timeout: 60_000, interval: 1 },
    );
    expect(keys.length).toBeGreaterThan(3);
    expect(new Set(keys).size).toBe(keys.length);
    const atRest = set.marchKey;
    set.advance(0.05);
    expect(set.marchKey).toBe(atRest);
  });

  it("is not needed to find the source of a volume", async () => {
    makeSet(0);
    set.sync(opened("off"), [], true);
    expect(set.source("r0_c1", "B")).toBeNull();
    const [source, again] = await Promise.all([
      set.sourceOf("r0_c1", "B"),
      set.sourceOf("r0_c1", "B"),
    ]);
    expect(source?.volume.tile).toBe("r0_c1");
    expect(again).toBe(source);
    expect(set.source("r0_c1", "B")).toBe(source);
    expect(await set.sourceOf("nowhere", "B")).toBeNull();
    expect(set.bytes).toBe(0);
  });

  it("is filled with volumes that failed, after a retry", async () => {
    makeSet(Number.POSITIVE_INFINITY);
    const { fetch } = globalThis;
    const without = (part: string) =>
      vi.stubGlobal("fetch", async (...request: Parameters<typeof fetch>) =>
        String(request[0]).includes(part) ? new Response("", { status: 404 }) : fetch(...request),
      );
    const state = opened("all");
    const [wanted] = wantedTiles(state, NO_FOCUS);
    const sync = () => set.sync(state, [wanted], true);
    const fails = async () => {
      sync();
      await vi.waitFor(() => expect(faults).toHaveLength(4));
      sync();
      expect(set.isLoading).toBe(false); // no retry without a request
      faults.length = 0;
      set.retryFailed();
    };
    without("volumes.json");
    await fails();
    without(".ktx2");
    await fails();
    vi.stubGlobal("fetch", fetch);
    sync();
    await vi.waitFor(
      () => {
        set.advance(0.05);
        expect(set.status().map(({ level }) => level)).toEqual([0, 0, 0, 0]);
      },
      { timeout: 60_000 },
    );
  });

  it("stays within the budget while one channel after another is shown", async () => {
    const budget = FADING * (TILES + KEPT_TILES) * bytesOf(0, 1);
    makeSet(budget);
    let state = opened("all");
    for (const channel of ["B", "C", "D"]) {
      state = reduce(state, { type: "show", channel, shown: false });
    }
    const mosts = [await sync(state, all())];
    const levels = [coarsestNow()];
    for (const channel of ["B", "C", "D"]) {
      state = reduce(state, { type: "show", channel, shown: true });
      mosts.push(await sync(state, all()));
      levels.push(coarsestNow());
    }
    expect(Math.max(...mosts)).toBeLessThanOrEqual(budget);
    expect(levels[0]).toBe(0);
    expect(levels).toEqual([...levels].sort());
  });

  it("stays within the budget while the gaze moves through all tiles", async () => {
    const budget = FADING * (1 + KEPT_TILES) * bytesOf(0, 4);
    makeSet(budget);
    const state = opened("tile");
    for (const tile of [...all(), ...all()]) {
      const most = await sync(state, [tile]);
      expect(levelsNow()).toEqual(new Set([0]));
      expect(most).toBeLessThanOrEqual(budget); // also while the tiles that were left fade out
      expect(set.bytes).toBeLessThanOrEqual(budget);
    }
    expect(set.bytes).toBe((1 + KEPT_TILES) * bytesOf(0, 4)); // the last tiles are kept
  });

  it("stays within the budget when all tiles follow a few that used all of it", async () => {
    const budget = FADING * (1 + KEPT_TILES) * bytesOf(0, 4);
    makeSet(budget);
    for (const tile of all().slice(0, 3)) await sync(opened("tile"), [tile]);
    expect(set.bytes).toBe((1 + KEPT_TILES) * bytesOf(0, 4));
    await sync(opened("all"), all());
    expect(levelsNow()).toEqual(new Set([1]));
    expect(set.bytes).toBe(TILES * bytesOf(1, 4));
  });
});
