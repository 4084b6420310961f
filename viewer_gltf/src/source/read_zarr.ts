/**
 * Opens an OME-Zarr image with zarrita: Zarr v2 and v3, sharded or not, on a host, in a zip archive or in a dropped
 * folder.
 */
import * as zarr from "zarrita";
import type { FileStore } from "./byte_source";
import { type Canonical, canonicalOf, IDENTITY, turned, UM_PER_MM } from "./canonical";
import {
  blockFor,
  type CoarseVolume,
  type LevelPlace,
  makeCoarse,
  SHOWN_VOXELS,
  type StoredVoxels,
  type Triple,
  triple,
} from "./coarse_volume";
import { directionsOf, type NgffImage, parseNgff } from "./ngff";
import type { OpenedImage } from "./opened_image";
import { SourceError } from "./source_error";
import { channelsOf, chooseChannels } from "./zarr_channels";
import { explained } from "./zarr_faults";
import {
  chooseLevel,
  type Level,
  openLevel,
  placeOfLevel,
  type Store,
  spatial,
} from "./zarr_levels";

/** Largest number of simultaneous requests; a browser opens six connections to a host with HTTP/1.1. */
const AT_ONCE = 8;

/**
 * @param name the name of the source that users see
 * @param most largest number of voxels of all channels together
 */
export async function openZarr(
  files: FileStore,
  name: string,
  most = SHOWN_VOXELS,
): Promise<OpenedImage> {
  const counts = { found: 0, missing: 0 };
  const store = counted(files, counts);
  const attributes = await attributesOf(store, name).catch((error: unknown) => {
    throw files.refusal ?? error;
  });
  const image = parseNgff(attributes, name);
  const finest = await openLevel(store, image, 0, name);
  const channelAxis = image.axes.indexOf("c");
  const total = channelAxis === -1 ? 1 : finest.shape[channelAxis];
  const chosen = chooseChannels(image.channels, total);
  const each = most / chosen.length;
  const { level, array } = await chooseLevel(store, image, finest, each, name);

  const notes = [...image.notes, ...notesOn(image, level, finest, chosen, total)];
  const stored = gridOf(image, level, finest, array);
  const canonical = canonicalOfImage(image, stored);
  if (canonical === null && image.orientations.some((text) => text !== "")) {
    notes.push(
      "The sides of the patient are not known, because the file does not state a valid orientation for all axes.",
    );
  }
  const { shape, spacing_um, levelShape, place } =
    canonical === null ? stored : turnedGrid(stored, canonical);
  const apart = triple((i) => place.step[i] * spacing_um[i]);
  const block = blockFor(levelShape, apart, each);
  const read = async (index: number, onShare?: (share: number) => void): Promise<CoarseVolume> => {
    const queue = new Queue(AT_ONCE, onShare);
    const voxels = await readLevel(array, image.axes, index, queue, name);
    if (counts.found === 0 && counts.missing > 0) {
      throw new SourceError(
        `${name}: found none of the ${counts.missing} chunks of level ${image.levels[level].path}: ask the author of the ` +
          "image to upload them.",
      );
    }
    return makeCoarse(canonical === null ? voxels : turned(voxels, canonical), block, place, name);
  };
  return {
    ...{ name, notes, shape, spacing_um },
    placement: canonical?.placement ?? IDENTITY,
    hasSides: canonical !== null,
    isSigned: !array.dtype.startsWith("u"),
    channels: channelsOf(image.channels, chosen, array.dtype, read),
  };
}

/** The finest resolution level of the image and the one that is shown, along z, y and x. */
type Grid = Readonly<{
  shape: Triple;
  spacing_um: Triple;
  levelShape: Triple;
  place: LevelPlace;
}>;

function gridOf(image: NgffImage, level: number, finest: Level, array: Level): Grid {
  const shape = spatial(image.axes, finest.shape);
  const levelShape = spatial(image.axes, array.shape);
  const spacing_um = image.levels[0].scale_um ?? [1, 1, 1];
  const place = placeOfLevel(image, level, shape, levelShape, spacing_um);
  return { shape, spacing_um, levelShape, place };
}

/** Returns the canonical axes if the image states the sides of a body; otherwise null. */
function canonicalOfImage(image: NgffImage, { shape, spacing_um }: Grid): Canonical | null {
  const ways = directionsOf(image.orientations);
  if (ways === null) return null;
  const shift = image.levels[0].shift_um ?? [0, 0, 0];
  const along = (axis: number, um: number) => triple((i) => (ways[axis][i] * um) / UM_PER_MM);
  const [z, y, x] = [0, 1, 2].map((axis) => along(axis, spacing_um[axis]));
  const shifts = [0, 1, 2].map((axis) => along(axis, shift[axis]));
  const origin = triple((i) => shifts.reduce((sum, one) => sum + one[i], 0));
  return canonicalOf({ axes: [z, y, x], origin }, shape);
}

function turnedGrid(grid: Grid, { order, flips, spacing_um }: Canonical): Grid {
  const turn = (values: Triple) => triple((i) => values[order[i]]);
  const shape = turn(grid.shape);
  const levelShape = turn(grid.levelShape);
  const step = turn(grid.place.step);
  const first = turn(grid.place.first);
  const behind = triple((i) => shape[i] - 1 - first[i] - (levelShape[i] - 1) * step[i]);
  const place = { first: triple((i) => (flips[i] ? behind[i] : first[i])), step };
  return { shape, spacing_um, levelShape, place };
}

/** Returns the store, which from then on counts the chunks that were found and those that were missing. */
function counted(files: FileStore, counts: { found: number; missing: number }): Store {
  const count = (key: string, bytes: Uint8Array | undefined) => {
    const isMetadata = /(^|\/)(zarr\.json|\.z(array|attrs|group|metadata))$/.test(key);
    if (!isMetadata) counts[bytes === undefined ? "missing" : "found"]++;
    return bytes;
  };
  return {
    get: async (key) => count(key, await files.get(key)),
    getRange: async (key, range) => count(key, await files.getRange(key, range)),
  };
}

/** Returns the attributes of the group. Throws SourceError if there is no group. */
async function attributesOf(store: Store, name: string): Promise<unknown> {
  const node = await explained(name, () => zarr.open(store));
  if (node instanceof zarr.Array) {
    throw new SourceError(
      `${name}: found a Zarr array, expected the group of an OME-Zarr image: try the folder above it.`,
    );
  }
  return node.attrs;
}

function notesOn(
  image: NgffImage,
  level: number,
  finest: Level,
  chosen: readonly number[],
  total: number,
): readonly string[] {
  const notes: string[] = [];
  const times = image.axes.includes("t") ? finest.shape[image.axes.indexOf("t")] : 1;
  if (times > 1) notes.push(`Only the first of ${times} time points is shown.`);
  if (chosen.length < total) {
    notes.push(
      `Only ${chosen.length} of ${total} channels are shown, because a page reads no more.`,
    );
  }
  const count = image.levels.length;
  if (level > 0) {
    notes.push(
      `Resolution level ${level + 1} of ${count} is shown (1 is the finest). Use stereocell build to see all voxels.`,
    );
  }
  return notes;
}

/** Reads the voxels (z, y, x) of a channel at the first time point. */
async function readLevel(
  array: Level,
  axes: readonly string[],
  channel: number,
  queue: Queue,
  name: string,
): Promise<StoredVoxels> {
  const selection = axes.map((axis) => (axis === "t" ? 0 : axis === "c" ? channel : null));
  const chunk = await explained(name, () =>
    zarr.get(array, selection, { createQueue: () => queue }),
  );
  const left = axes.filter((axis) => axis !== "t" && axis !== "c");
  const { data, shape, stride } = chunk as zarr.Chunk<zarr.NumberDataType>;
  const isWide = data instanceof BigInt64Array || data instanceof BigUint64Array;
  return {
    data: isWide ? Float64Array.from(data as unknown as BigInt64Array, Number) : data,
    shape: spatial(left, shape),
    offset: 0,
    strides: spatial(left, stride),
    ...{ slope: 1, intercept: 0 },
  };
}

/** Runs at most `limit` jobs at a time, and starts none after one has failed. */
class Queue {
  private readonly jobs: (() => Promise<void>)[] = [];
  private added = 0;
  private done = 0;

  /** @param onShare called with the share of the jobs that is done, 0..1 */
  constructor(
    private readonly limit: number,
    private readonly onShare?: (share: number) => void,
  ) {}

  add(job: () => Promise<void>): void {
    this.jobs.push(job);
    this.added++;
  }

  onIdle() {
    return Promise.all(Array.from({ length: this.limit }, () => this.work()));
  }

  private async work(): Promise<void> {
    for (let job = this.jobs.shift(); job !== undefined; job = this.jobs.shift()) {
      try {
        await job();
        this.onShare?.(++this.done / this.added);
      } catch (error) {
        this.jobs.length = 0;
        throw error;
      }
    }
  }
}
