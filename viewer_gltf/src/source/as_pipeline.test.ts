/** Compares a source that the page opens with `stereocell view` and a build of the same files. */
import { mkdtemp, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { afterAll, beforeAll, describe, expect, it } from "vitest";
import { ZSTDDecoder } from "zstddec";
import { askPython, hasPython } from "../../test/support/python";
import { localSource } from "../../test/support/source/local";
import { fetchFile } from "../bundle/fetch";
import type { Channel, Manifest } from "../bundle/generated/bundle";
import type { ChannelTransfer2D } from "../bundle/generated/transfer2d";
import type { TileVolume } from "../bundle/generated/volumes";
import { readTexture } from "../bundle/ktx2";
import { loadTransfer2d, loadVolumes } from "../bundle/load";
import { LocalFolder } from "./byte_source";
import { type CoarseVolume, SHOWN_VOXELS, type Triple } from "./coarse_volume";
import type { OpacityPoints } from "./opacity";
import { evaluate } from "./opacity";
import { openLocal, type ShownSource } from "./open_source";
import { openZarr } from "./read_zarr";

type PythonChannel = Channel &
  Readonly<{
    volume: TileVolume & { voxels: string };
    functions: Readonly<Record<string, OpacityPoints>>;
    shapes: ChannelTransfer2D["functions"];
  }>;
type PythonView = Omit<Manifest, "channels"> & { channels: PythonChannel[] };

const SOURCES = [
  "v04.ome.zarr",
  "v05.ome.zarr",
  "sharded.ome.zarr",
  "sharded.ozx",
  "head.nii.gz",
  "sided.ome.zarr",
];

/** Centre of the bright voxels (z, y, x), um from the first voxel of the finest level. */
function middleOf({ voxels, shape, first, step }: CoarseVolume, spacing_um: Triple): Triple {
  const sums = [0, 0, 0, 0];
  voxels.forEach((value, i) => {
    if (value < 300) return; // the background has values of at most 200
    const place = [
      Math.floor(i / (shape[1] * shape[2])),
      Math.floor(i / shape[2]) % shape[1],
      i % shape[2],
    ];
    place.forEach((at, axis) => {
      sums[axis] += value * (first[axis] + at * step[axis]) * spacing_um[axis];
    });
    sums[3] += value;
  });
  return [sums[0] / sums[3], sums[1] / sums[3], sums[2] / sums[3]];
}

describe.skipIf(!hasPython)("a source in the page, compared with the pipeline", () => {
  let folder: string;
  let views: Readonly<Record<string, PythonView>>;
  const opened = new Map<string, ShownSource>();
  const zstd = new ZSTDDecoder();

  beforeAll(async () => {
    folder = await mkdtemp(join(tmpdir(), "stereocell-sources-"));
    views = JSON.parse(await askPython("page_sources", [folder, "views"], ""));
    await zstd.init();
    for (const name of SOURCES) {
      opened.set(name, await openLocal(await localSource(join(folder, name)), () => undefined));
    }
  }, 120_000);

  afterAll(() => rm(folder, { recursive: true, force: true }));

  const shown = (name: string) => {
    const found = opened.get(name);
    if (found === undefined) throw new Error(`${name} was not opened`);
    return { ...found, view: views[name] };
  };

  /** Volume and 8-bit voxels of a channel. */
  async function volumeOf(name: string, channel: Channel) {
    const { base } = shown(name).bundle;
    const volume = (await loadVolumes(base, channel.volumes)).get("r0_c0");
    if (volume === undefined) throw new Error("no volume");
    const { path } = volume.file;
    const texture = readTexture(await fetchFile(base, volume.file), path, "R8", volume.size);
    const [x, y, z] = volume.size;
    return { volume, voxels: zstd.decode(texture.levels[0].levelData, x * y * z) };
  }

  it.each(SOURCES)("%s has the same place, channels and colours", (name) => {
    const { bundle, view } = shown(name);
    const { specimen, tiles, channels } = bundle.manifest;
    expect(specimen.name).toBe(view.specimen.name);
    expect(specimen.modality).toBe(view.specimen.modality);
    expect(specimen.sides).toEqual(view.specimen.sides);
    expect(
      tiles.map(({ id, representation, unfinished }) => [id, representation, unfinished]),
    ).toEqual(
      view.tiles.map(({ id, representation, unfinished }) => [id, representation, unfinished]),
    );
    for (const end of ["min", "max"] as const) {
      for (const axis of [0, 1, 2]) {
        expect(specimen.bounds_um[end][axis]).toBeCloseTo(view.specimen.bounds_um[end][axis], 1);
      }
    }
    expect(channels.map(({ id, name, opens }) => [id, name, opens])).toEqual(
      view.channels.map(({ id, name, opens }) => [id, name, opens]),
    );
    channels.forEach(({ color }, i) => {
      for (const part of [0, 1, 2])
        expect(color[part]).toBeCloseTo(view.channels[i].color[part], 5);
    });
  });

  it.each(SOURCES)("%s has the windows of a build, within 1 %% of the window", (name) => {
    const { bundle, view } = shown(name);
    bundle.manifest.channels.forEach(({ window }, i) => {
      const { window: expected } = view.channels[i];
      const width = expected[1] - expected[0];
      expect(Math.abs(window[0] - expected[0])).toBeLessThan(0.01 * width);
      expect(Math.abs(window[1] - expected[1])).toBeLessThan(0.01 * width);
    });
  });

  it.each(SOURCES)("%s has the transfer functions of a build at that level", async (name) => {
    const { bundle, view } = shown(name);
    for (const [i, channel] of bundle.manifest.channels.entries()) {
      const names = channel.transfer_functions;
      const { path } = channel.lut;
      const file = await fetchFile(bundle.base, channel.lut);
      const texture = readTexture(file, path, "R8G8B8A8", [256, names.length, 1]);
      const texels = zstd.decode(texture.levels[0].levelData, names.length * 1024);
      const common = ["default", "soft", "sharp", "surface"];
      expect(names.slice(0, 4)).toEqual(common);
      for (const [row, each] of common.entries()) {
        const expected = evaluate(view.channels[i].functions[each]);
        const apart = expected.map((v, x) => Math.abs(v - texels[4 * (256 * row + x) + 3] / 255));
        // The mean is compared: where a function has a step, a shift by 1/256 of the window changes single values a lot.
        const mean = apart.reduce((sum, v) => sum + v, 0) / 256;
        expect(mean, `${channel.id} ${each}`).toBeLessThan(0.01);
      }
    }
  });

  it("shows an MR with the same greys as a build", async () => {
    const { bundle, view } = shown("head.nii.gz");
    const [channel] = bundle.manifest.channels;
    expect(channel.transfer_function).toBe("grey");
    const { file, names } = channel.transfer_functions_2d;
    expect(names).toEqual(["grey"]);
    const { functions } = await loadTransfer2d(bundle.base, file);
    const expected = view.channels[0].shapes.grey;
    expect(functions.grey.length).toBe(expected.length);
    functions.grey.forEach((shape, i) => {
      for (const end of [0, 1]) {
        expect(Math.abs(shape.values[end] - expected[i].values[end])).toBeLessThan(0.01);
        expect(Math.abs(shape.gradients[end] - expected[i].gradients[end])).toBeLessThan(0.02);
      }
      expect(Math.abs(shape.opacity - expected[i].opacity)).toBeLessThan(0.02);
      expect(shape.color[0]).toBeCloseTo(expected[i].color[0], 4);
      expect(shape.softness).toBe(expected[i].softness);
    });
  });

  it.each(SOURCES)("%s has the same voxels at the same places", async (name) => {
    const { bundle, view } = shown(name);
    for (const [i, channel] of bundle.manifest.channels.entries()) {
      const { volume, voxels } = await volumeOf(name, channel);
      const expected = view.channels[i].volume;
      expect(volume.size).toEqual(expected.size);
      expect(volume.levels.map(({ size }) => size)).toEqual(
        expected.levels.map(({ size }) => size),
      );
      volume.matrix.forEach((value, at) => {
        expect(value).toBeCloseTo(expected.matrix[at], 2);
      });
      const theirs = Buffer.from(expected.voxels, "base64");
      expect(voxels.length).toBe(theirs.length);
      const apart = voxels.reduce((sum, v, at) => sum + Math.abs(v - theirs[at]), 0);
      expect(apart / voxels.length).toBeLessThan(1.5); // grey levels of 255; windows differ a little
    }
  });

  it.each(["v04.ome.zarr", "sided.ome.zarr"])("%s has one place at all levels", async (name) => {
    const source = await localSource(join(folder, name));
    if (source.kind !== "folder") throw new Error("expected a folder");
    const levels = [SHOWN_VOXELS, 20_000].map(async (most) => {
      const image = await openZarr(new LocalFolder(source.find), name, most);
      const coarse = await image.channels[0].read();
      return { image, coarse, middle: middleOf(coarse, image.spacing_um) };
    });
    const [fine, coarse] = await Promise.all(levels);
    expect(coarse.coarse.voxels.length).toBeLessThan(fine.coarse.voxels.length);
    expect(coarse.image.shape).toEqual(fine.image.shape);
    expect(coarse.image.placement).toEqual(fine.image.placement);
    expect(coarse.image.notes).toContain(
      "Resolution level 2 of 2 is shown (1 is the finest). Use stereocell build to see all voxels.",
    );
    for (const axis of [0, 1, 2]) {
      const apart_um = Math.abs(coarse.middle[axis] - fine.middle[axis]);
      expect(apart_um).toBeLessThan(0.15 * fine.image.spacing_um[axis]);
    }
  });

  it("refuses an image whose coarsest level is too large for a page", async () => {
    const source = await localSource(join(folder, "v04.ome.zarr"));
    if (source.kind !== "folder") throw new Error("expected a folder");
    await expect(openZarr(new LocalFolder(source.find), "v04", 400)).rejects.toThrow(
      "ask its author to add coarser levels",
    );
  });

  it("notes the time points that are not shown", () => {
    expect(shown("v04.ome.zarr").notes).toEqual(["Only the first of 2 time points is shown."]);
    expect(shown("head.nii.gz").notes).toEqual([]);
  });
});
