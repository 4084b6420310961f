/** Load the small files of a bundle: the manifest, and a channel's list of volumes. */
import { checkManifest, checkVolumes } from "./check";
import { fetchFile, fileAddress, parseJson, readBody, request } from "./fetch";
import type { FileRef, Manifest } from "./generated/bundle";
import type { TileVolume } from "./generated/volumes";

export type Bundle = Readonly<{ base: string; manifest: Manifest }>;

/** Load and check the bundle in the folder `base`. Throws BundleError. */
export async function loadBundle(base: string): Promise<Bundle> {
  const path = "manifest.json";
  const response = await request(fileAddress(base, path), path, { cache: "no-cache" });
  const text = new TextDecoder().decode(await readBody(response, path));
  return { base, manifest: checkManifest(parseJson(text, path)) };
}

/** The volumes of one channel, by tile. Throws BundleError. */
export async function loadVolumes(
  base: string,
  file: FileRef,
): Promise<ReadonlyMap<string, TileVolume>> {
  const text = new TextDecoder().decode(await fetchFile(base, file));
  const { volumes } = checkVolumes(parseJson(text, file.path), file.path);
  return new Map(volumes.map((volume) => [volume.tile, volume]));
}
