/** Lists the files that a user may need from the present view on, by tile and level of detail. */
import { fileAddress } from "../bundle/fetch";
import type { Channel } from "../bundle/generated/bundle";
import type { Asked } from "../bundle/request_log";
import { contentHashes, TilesetFiles } from "../bundle/tileset_files";
import type { PartHost } from "../host/part";
import { wantsSurface } from "../state/representation";
import { volumeChannels } from "../state/viewer_state";
import type { VolumeSource } from "../voxels/volume_source";
import type { Layer, Levels } from "./coverage";

export class OfflineLayers {
  /** The surfaces of each channel that has been shown. */
  private readonly surfaces = new Map<string, Layer>();

  constructor(private readonly host: PartHost) {}

  /** Returns the layers of the channels that are shown now. Throws BundleError if a list of files cannot be fetched. */
  async now(): Promise<readonly Layer[]> {
    const { state, bundle } = this.host;
    const layers: Layer[] = [];
    for (const channel of state.channels) {
      const found = bundle.manifest.channels.find(({ id }) => id === channel.id);
      if (!found || !channel.hasSurface || !wantsSurface(state, channel)) continue;
      const layer = this.surfaces.get(channel.id) ?? (await this.surfacesOf(found));
      this.surfaces.set(channel.id, layer);
      layers.push(layer);
    }
    if (state.mode === "off") return layers;
    return [...layers, ...volumeChannels(state).map(({ id }) => this.volumesOf(id))];
  }

  private async surfacesOf({ tileset }: Channel): Promise<Layer> {
    const { base, manifest } = this.host.bundle;
    if (tileset === null) return [];
    const files = new TilesetFiles(base, tileset);
    const paths: string[] = [];
    const read = async (address: string): Promise<void> => {
      const found = await files.fetch(address);
      if (found instanceof ArrayBuffer) return;
      for (const each of contentHashes(found, files.nameOf(address), address).keys()) {
        if (each.endsWith(".json")) await read(each);
        else paths.unshift(files.nameOf(each)); // a tileset has coarse levels before fine ones
      }
    };
    await read(files.root);
    return manifest.tiles.map(({ id }) => ({
      tile: id,
      levels: paths
        .filter((path) => path.split("/").includes(id))
        .map((path) => [{ url: fileAddress(base, path), range: null }]),
    }));
  }

  private volumesOf(channel: string): Layer {
    const { bundle } = this.host;
    const volumes = this.host.service("volumes");
    return bundle.manifest.tiles.flatMap(({ id }) => {
      const source = volumes?.source(id, channel) ?? null;
      return source === null ? [] : [{ tile: id, levels: levelsOf(bundle.base, source) }];
    });
  }
}

function levelsOf(base: string, { volume }: VolumeSource): Levels["levels"] {
  const { file, bricks, levels } = volume;
  const bounds: Asked = { url: fileAddress(base, bricks.path), range: null };
  return levels.map(({ offset, length }) => {
    const range = `bytes=${offset}-${offset + length - 1}`;
    return [bounds, { url: fileAddress(base, file.path), range }];
  });
}
