/** Loads the small files of a bundle: the manifest, and a channel's list of volumes, 2D functions and histogram. */

import { bricksAddress } from "./brick_host";
import { fetchFile, fileAddress, parseJson, readBody, request } from "./fetch";
import type { FileRef, Manifest } from "./generated/bundle";
import type { ChannelTransfer2D } from "./generated/transfer2d";
import type { TileVolume } from "./generated/volumes";
import { readLevel, readTexture } from "./ktx2";
import { type LiveHost, liveHost } from "./live_host";
import { checkManifest, checkTransfer2d, checkVolumes } from "./schema_check";
import { COLUMNS, ROWS } from "./transfer_2d";
import { valuesAddress } from "./values_host";

export type Bundle = Readonly<{
  base: string;
  manifest: Manifest;
  /**
   * Address of the websocket that sends the bricks that the camera's view needs; if absent, volumes
   * are files.
   */
  bricks?: string;
  /** Address of the measured values; absent if the host has none. */
  values?: string;
  /** The build of which this is an intermediate bundle; absent if the bundle is complete. */
  live?: LiveHost;
}>;

/**
 * Loads and checks the bundle in the folder `base`. Throws BundleError.
 *
 * ```ts
 * import { loadBundle } from "./load";
 *
 * const { manifest } = await loadBundle("https://lab.example/specimen/");
 * const surfaces = manifest.channels.filter(({ surface }) => surface !== "none");
 * document.title = `${manifest.specimen.name}: ${surfaces.map(({ name }) => name).join(", ")}`;
 * ```
 */
export async function loadBundle(base: string): Promise<Bundle> {
  const path = "manifest.json";
  const response = await request(fileAddress(base, path), path, { cache: "no-cache" });
  const text = new TextDecoder().decode(await readBody(response, path));
  const manifest = checkManifest(parseJson(text, path));
  const bricks = bricksAddress(response.headers, base);
  const values = valuesAddress(response.headers, base);
  const live = liveHost(response.headers, base);
  return {
    base: live === null ? base : new URL(live.folder, base).href,
    manifest,
    ...(bricks === null ? {} : { bricks }),
    ...(values === null ? {} : { values }),
    ...(live === null ? {} : { live }),
  };
}

/** Loads the list of a channel's volumes, by tile. Throws BundleError. */
export async function loadVolumes(
  base: string,
  file: FileRef,
): Promise<ReadonlyMap<string, TileVolume>> {
  const text = new TextDecoder().decode(await fetchFile(base, file));
  const { volumes } = checkVolumes(parseJson(text, file.path), file.path);
  return new Map(volumes.map((volume) => [volume.tile, volume]));
}

/** Loads the two-dimensional transfer functions of one channel. Throws BundleError. */
export async function loadTransfer2d(base: string, file: FileRef): Promise<ChannelTransfer2D> {
  const text = new TextDecoder().decode(await fetchFile(base, file));
  return checkTransfer2d(parseJson(text, file.path), file.path);
}

/** Loads a histogram of value and gradient, COLUMNS x ROWS bytes, row 0 first. Throws BundleError. */
export async function loadHistogram(base: string, file: FileRef): Promise<Uint8Array> {
  const bytes = await fetchFile(base, file);
  const texture = readTexture(bytes, file.path, "R8", [COLUMNS, ROWS, 1]);
  return readLevel(texture, file.path, "R8", 0);
}
