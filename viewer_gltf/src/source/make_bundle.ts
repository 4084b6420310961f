/**
 * Makes a bundle of an opened image: the manifest, volumes, transfer functions and histograms that a build writes, by
 * the same schema. The page holds these files, and shows a source by the same code as a bundle.
 *
 * Follows pipeline/stereocell/live/first_view.py. The bundle has one tile, and no surfaces.
 */
import type { Channel, FileRef, Manifest } from "../bundle/generated/bundle";
import type { TileVolume } from "../bundle/generated/volumes";
import { holdFiles } from "../bundle/held_files";
import type { Size3 } from "../bundle/ktx2";
import type { Bundle } from "../bundle/load";
import { checkManifest, checkTransfer2d, checkVolumes } from "../bundle/schema_check";
import { COLUMNS, ROWS } from "../bundle/transfer_2d";
import type { Rgb } from "../math/color";
import { chooseColors } from "./choose_colors";
import { type CoarseVolume, type Places, placesAlong, resample, triple } from "./coarse_volume";
import { findLevel } from "./find_level";
import { histogramOf, type Kind, kindOf, type Window, windowOf } from "./find_window";
import { GREY, greyShapes } from "./grey_shapes";
import { evaluate, makeFunctions, type OpacityPoints } from "./opacity";
import type { ImageChannel, OpenedImage, Report } from "./opened_image";
import { writeKtx2 } from "./texture_file";
import { countJoint, logScaled, minMaxBricks, mipLevels, toTexels } from "./volume_files";

/** Texels around the volume on every side, as `model/tile_content.py` has them. */
const APRON = 1;
const TILE = "r0_c0";
/** The gradient magnitude of the last row of a histogram: the default of `TransferFunctions2d`. */
const GRADIENT_MAX = 0.5;
/** Value at which the skin begins, Hounsfield units: presets/ct.toml. */
const SKIN_HU = -300;
/** Directions of a patient's sides; the same as `PATIENT_SIDES` of usd/opening.py. */
const SIDES = { left: [1, 0, 0], posterior: [0, 0, -1], superior: [0, 1, 0] } as const;
const NO_SURFACE = "surfaces are made by a build: stereocell build";

type Files = Map<string, Uint8Array<ArrayBuffer>>;
/** Properties that all channels share. */
type Frame = Readonly<{
  places: readonly [Places, Places, Places];
  bounds: TileVolume["bounds_um"];
  matrix: TileVolume["matrix"];
  depth_voxels: number;
  kind: Kind;
}>;

/** Reads the channels of an image and makes a bundle of them. Throws SourceError. */
export async function makeBundle(image: OpenedImage, report: Report): Promise<Bundle> {
  const volumes: CoarseVolume[] = [];
  for (const [i, channel] of image.channels.entries()) {
    const count = image.channels.length;
    const what = count === 1 ? "the volume" : `channel ${i + 1} of ${count}`;
    report(`Reading ${what}`);
    const onShare = (share: number) => report(`Reading ${what}: ${Math.round(100 * share)} %`);
    volumes.push(await channel.read(onShare));
  }
  report("Preparing the view");
  await new Promise((resolve) => setTimeout(resolve)); // lets the browser draw the words
  const files: Files = new Map();
  const frame = frameOf(image, volumes);
  const stated = image.channels.map(({ color }) => color);
  const colors = chooseColors(stated, frame.kind.modality, Math.min(...image.spacing_um));
  const channels: Channel[] = [];
  for (const [i, channel] of image.channels.entries()) {
    channels.push(await describeChannel(files, channel, volumes[i], colors[i], frame));
  }
  const manifest = await describe(files, image, frame, channels);
  return { base: holdFiles(files), manifest: checkManifest(manifest) };
}

function frameOf(image: OpenedImage, volumes: readonly CoarseVolume[]): Frame {
  const { shape, spacing_um, placement } = image;
  const finest = Math.min(...spacing_um);
  const places = [0, 1, 2].map((i) => placesAlong(shape[i], volumes[0].step[i], APRON));
  const [depth, height, width] = triple((i) => (shape[i] - 1) * spacing_um[i]);
  const kind = kindOf(volumes[0].sample.slice().sort(), spacing_um, shape, image);
  return {
    places: [places[0], places[1], places[2]],
    bounds: { min: [0, -height + 0, 0], max: [width, 0, depth] },
    matrix: [...placement] as TileVolume["matrix"],
    depth_voxels: Math.min(...shape.map((n, i) => (n * spacing_um[i]) / finest)),
    kind,
  };
}

async function describe(
  files: Files,
  image: OpenedImage,
  { bounds, matrix, kind }: Frame,
  channels: readonly Channel[],
): Promise<Manifest> {
  const world = moved(bounds, matrix);
  const middle = (world.min[0] + world.max[0]) / 2;
  const index = new TextEncoder().encode(JSON.stringify({}));
  return {
    format: "stereocell-bundle",
    version: 1,
    generator: "StereoCell, in the page",
    specimen: {
      name: image.name,
      modality: kind.modality,
      ...(image.hasSides ? { sides: structuredClone(SIDES) as never } : {}),
      ...(kind.modality === "MR" ? { cut: { normal: [1, 0, 0], offset_um: middle } } : {}),
      bounds_um: world,
    },
    tiles: [{ id: TILE, representation: "mesh", bounds_um: world, unfinished: true }],
    channels: [...channels],
    files: await put(files, "files.json", index),
  };
}

async function describeChannel(
  files: Files,
  { name, window: stated, opens }: ImageChannel,
  coarse: CoarseVolume,
  color: Rgb,
  frame: Frame,
): Promise<Channel> {
  const id = identifierOf(name);
  const window = stated ?? windowOf(frame.kind, coarse.sample.slice().sort());
  const { modality } = frame.kind;
  const isCalibrated = modality === "CT";
  const inWindow = (value: number) =>
    Math.min(1, Math.max(0, (value - window[0]) / (window[1] - window[0])));
  const histogram = histogramOf(coarse.sample, window);
  const level = isCalibrated ? inWindow(SKIN_HU) : findLevel(histogram);
  const functions = makeFunctions(histogram, {
    ...{ level, modality, depth_voxels: frame.depth_voxels },
  });
  const { volume, joint } = await writeVolume(files, id, coarse, window, frame);
  const volumes = { volumes: [volume] };
  const most = joint.reduce((a, b) => Math.max(a, b), 0);
  const picture = writeKtx2([COLUMNS, ROWS, 1], 1, [logScaled(joint, most)]);
  const opacity = functions.get("default") ?? [];
  const isGrey = modality === "MR" && level !== null;
  const shapes = isGrey ? { [GREY]: greyShapes(level, histogram, opacity, GRADIENT_MAX) } : {};
  const transfer2d = {
    ...{ gradient_max: GRADIENT_MAX, functions: shapes, most },
    histogram: await put(files, `channels/${id}/histogram2d.ktx2`, picture.file),
  };
  // Where gradients are not known, a row of intensities replaces the two-dimensional function.
  const rows = new Map([
    ...functions,
    ...Object.keys(shapes).map((key) => [key, opacity] as const),
  ]);
  const table = writeKtx2([256, rows.size, 1], 4, [bake([...rows.values()])]);
  const [firstName, ...otherNames] = rows.keys();
  // The same choice as `make_appearance` of the pipeline: "soft" lets other channels show within an object.
  const opening = isGrey ? GREY : modality === "" && level !== null ? "soft" : "default";
  return {
    ...{ id, name, opens, color: [...color], window: [...window] },
    iso_value: isCalibrated ? SKIN_HU : null,
    iso_normalized: isCalibrated ? inWindow(SKIN_HU) : null,
    threshold_normalized: null,
    surface: "none",
    surface_reason: NO_SURFACE,
    level: null,
    transfer_function: opening,
    transfer_functions: [firstName, ...otherNames],
    transfer_functions_2d: {
      names: Object.keys(shapes),
      file: await putJson(files, `channels/${id}/transfer2d.json`, transfer2d, checkTransfer2d),
    },
    lut: await put(files, `luts/${id}.ktx2`, table.file),
    tileset: null,
    triangles: [],
    distances: [],
    volumes: await putJson(files, `channels/${id}/volumes.json`, volumes, checkVolumes),
  };
}

async function writeVolume(
  files: Files,
  id: string,
  coarse: CoarseVolume,
  window: Window,
  { places, bounds, matrix }: Frame,
): Promise<Readonly<{ volume: TileVolume; joint: Float64Array }>> {
  const [depth, height, width] = places.map(({ count }) => count);
  const size: Size3 = [width, height, depth];
  const data = toTexels(resample(coarse, places), window);
  const levels = mipLevels({ size, data });
  const bricks = minMaxBricks({ size, data });
  const texture = writeKtx2(
    size,
    1,
    levels.map((level) => level.data),
  );
  const path = `volumes/${TILE}/${id}`;
  const apart = [0, 1, 2].map((axis) => {
    const n = size[axis] - 1 - 2 * APRON;
    return (bounds.max[axis] - bounds.min[axis]) / Math.max(1, n);
  });
  // An axis with a single plane has a step of 0; it gets the smallest step of the others, at most 1 um.
  const finest = Math.min(...apart.filter((step) => step > 0), 1);
  const [sx, sy, sz] = apart.map((step) => step || finest);
  const described = levels.map(async (level, i) => {
    const { offset, length } = texture.levels[i];
    const frame = texture.file.subarray(offset, offset + length);
    return {
      size: [...level.size] as [number, number, number],
      offset,
      length,
      sha256: await hashOf(frame),
    };
  });
  const [first, ...others] = await Promise.all(described);
  return {
    volume: {
      tile: TILE,
      file: await put(files, `${path}.ktx2`, texture.file),
      bricks: await put(
        files,
        `${path}_bricks.ktx2`,
        writeKtx2(bricks.size, 2, [bricks.data]).file,
      ),
      size: [...size],
      apron: APRON,
      bounds_um: bounds,
      matrix,
      levels: [first, ...others],
    },
    joint: countJoint({ size, data }, [sx, sy, sz], GRADIENT_MAX),
  };
}

/** Returns a row of 256 RGBA texels for each function: white, with the function's opacity. */
function bake(functions: readonly OpacityPoints[]): Uint8Array {
  const table = new Uint8Array(functions.length * 256 * 4).fill(255);
  functions.forEach((points, row) => {
    evaluate(points).forEach((opacity, i) => {
      table[(row * 256 + i) * 4 + 3] = Math.round(opacity * 255);
    });
  });
  return table;
}

/** Moves a box by a matrix (column-major), and returns the box along the world's axes that encloses the result. */
function moved(
  { min, max }: TileVolume["bounds_um"],
  m: TileVolume["matrix"],
): TileVolume["bounds_um"] {
  const corners = Array.from({ length: 8 }, (_, i) => {
    const [x, y, z] = [0, 1, 2].map((axis) => ((i >> axis) & 1 ? max : min)[axis]);
    return [0, 1, 2].map((row) => m[row] * x + m[4 + row] * y + m[8 + row] * z + m[12 + row]);
  });
  const ends = (pick: (...values: number[]) => number) =>
    [0, 1, 2].map((axis) => pick(...corners.map((corner) => corner[axis])));
  const [low, high] = [ends(Math.min), ends(Math.max)];
  return { min: [low[0], low[1], low[2]], max: [high[0], high[1], high[2]] };
}

/** Returns a name for use in a path. It follows model/identifiers.py, so that links to a view also work with a build. */
export function identifierOf(name: string): string {
  return [...name]
    .map((char, i, all) => {
      const isLetter = /[A-Za-z]/.test(char) || (/[0-9]/.test(char) && i > 0);
      const isKept = isLetter || (char === "_" && all[i + 1] !== "x");
      return isKept ? char : `_x${char.codePointAt(0)?.toString(16)}_`;
    })
    .join("");
}

async function hashOf(bytes: Uint8Array<ArrayBuffer>): Promise<string> {
  // Without a secure context the browser can't compute hashes, and none is checked: see bundle/hash.ts.
  if (!globalThis.isSecureContext) return "0".repeat(64);
  const digest = new Uint8Array(await crypto.subtle.digest("SHA-256", bytes));
  return Array.from(digest, (byte) => byte.toString(16).padStart(2, "0")).join("");
}

async function put(files: Files, path: string, bytes: Uint8Array<ArrayBuffer>): Promise<FileRef> {
  files.set(path, bytes);
  return { path, bytes: bytes.length, sha256: await hashOf(bytes) };
}

function putJson(
  files: Files,
  path: string,
  value: unknown,
  check: (value: unknown, path: string) => unknown,
): Promise<FileRef> {
  return put(files, path, new TextEncoder().encode(JSON.stringify(check(value, path))));
}
