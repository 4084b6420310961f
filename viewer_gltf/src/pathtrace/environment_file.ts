/** Reads light from all directions from a file: a built-in one, one of the bundle, or the user's .hdr or .exr. */
import { FloatType } from "three";
import { BundleError } from "../bundle/errors";
import { fetchFile, fileAddress, readBody, request } from "../bundle/fetch";
import type { FileRef } from "../bundle/generated/bundle";
import {
  asBrightAs,
  type EnvironmentTables,
  environmentTables,
  type Radiance,
} from "./environment_sampling";

/** Largest number of columns of an environment map. A finer map would make no visible difference on a volume. */
const MAX_COLUMNS = 512;
/** Largest number of texels of a file; larger files are refused. */
const MAX_TEXELS = 16384 * 8192;

/** Loads a built-in environment, which is hosted together with the viewer. Throws BundleError. */
export async function loadEnvironment(base: string, name: string): Promise<EnvironmentTables> {
  const path = `environments/${name}.hdr`;
  const response = await request(fileAddress(base, path), path);
  return environmentTables(await parseHdr(await readBody(response, path), path));
}

/** Loads the light of the stage's dome lights, which is a file of the bundle. Throws BundleError. */
export async function loadStageEnvironment(
  base: string,
  file: FileRef,
): Promise<EnvironmentTables> {
  const bytes = await fetchFile(base, file);
  return environmentTables(await parseExr(bytes, file.path));
}

/**
 * Reads a file of the user. Its unit does not matter, because it is scaled to the mean brightness of a white room.
 * Throws BundleError.
 */
export async function readEnvironment(file: File): Promise<EnvironmentTables> {
  const bytes = new Uint8Array(await file.arrayBuffer());
  const isExr = new DataView(bytes.buffer).byteLength > 4 && bytes[0] === 0x76 && bytes[1] === 0x2f;
  const radiance = await (isExr ? parseExr(bytes, file.name) : parseHdr(bytes, file.name));
  return asBrightAs(environmentTables(radiance), 1);
}

async function parseHdr(bytes: Uint8Array<ArrayBuffer>, name: string): Promise<Radiance> {
  const { HDRLoader } = await import("three/examples/jsm/loaders/HDRLoader.js");
  const loader = new HDRLoader();
  loader.type = FloatType;
  return radianceOf(name, false, () => loader.parse(bytes.buffer));
}

async function parseExr(bytes: Uint8Array<ArrayBuffer>, name: string): Promise<Radiance> {
  const { EXRLoader } = await import("three/examples/jsm/loaders/EXRLoader.js");
  const loader = new EXRLoader();
  loader.type = FloatType;
  return radianceOf(name, true, () => loader.parse(bytes.buffer)); // the loader returns the bottom row first
}

type Parsed = Readonly<{ width?: number; height?: number; data?: unknown }>;

function radianceOf(name: string, isFromBelow: boolean, parse: () => Parsed): Radiance {
  let parsed: Parsed;
  try {
    parsed = parse();
  } catch (error) {
    const reason = error instanceof Error ? error.message : String(error);
    throw new BundleError(`${name}: expected an environment map (.hdr or .exr): ${reason}`);
  }
  const { width = 0, height = 0, data } = parsed;
  const parts = data instanceof Float32Array ? data.length / (width * height) : 0;
  if (!(data instanceof Float32Array) || width * height > MAX_TEXELS || parts < 3) {
    throw new BundleError(
      `${name}: found ${width} x ${height} texels, expected a colour map of at most 134 million texels`,
    );
  }
  return reduced(data, width, height, parts, isFromBelow);
}

/** Returns the map as RGB, top row first, averaged over blocks to at most MAX_COLUMNS columns. */
export function reduced(
  data: Float32Array,
  width: number,
  height: number,
  parts: number,
  isFromBelow: boolean,
): Radiance {
  const factor = Math.max(1, Math.ceil(width / MAX_COLUMNS));
  const [columns, rows] = [Math.ceil(width / factor), Math.ceil(height / factor)];
  const rgb = new Float32Array(3 * columns * rows);
  const counts = new Float32Array(columns * rows);
  for (let y = 0; y < height; y++) {
    const from = (isFromBelow ? height - 1 - y : y) * width;
    for (let x = 0; x < width; x++) {
      const to = Math.floor(y / factor) * columns + Math.floor(x / factor);
      counts[to]++;
      for (let k = 0; k < 3; k++) rgb[3 * to + k] += data[(from + x) * parts + k];
    }
  }
  for (let i = 0; i < rgb.length; i++) rgb[i] /= counts[Math.floor(i / 3)];
  return { width: columns, height: rows, rgb };
}
