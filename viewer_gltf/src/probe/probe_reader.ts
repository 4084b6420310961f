/** Reads the specimen where a ray meets it: surface, volume or tile, and the channels' values. */

import type { Matrix4 } from "three";
import type { Manifest } from "../bundle/generated/bundle";
import type { TileVolume } from "../bundle/generated/volumes";
import type { ValuesHost } from "../bundle/values_host";
import type { Clip, ClipPlane } from "../math/clip";
import { pickTile, shownTiles } from "../math/pick";
import type { Ray, Vec3 } from "../math/vec3";
import type { LevelSource, ShownSurface, ShownVolume } from "../state/on_screen";
import type { ViewerState } from "../state/viewer_state";
import { VolumeSource } from "../voxels/volume_source";
import { measuredText, unitOf, valueAt, valueText, voxelAt } from "./measure";
import {
  type Cone,
  nearestIn,
  type Probed,
  type ProbedVolume,
  probeBoxes,
  probeSurfaces,
  probeVolumes,
  tileAt,
  unitRay,
} from "./probe";
import { availableLevel, TexelCache } from "./texel_cache";

/** Largest number of texels of the mip level in which the reader looks for a ray's hit. */
const PROBED_TEXELS = 2 * 1024 * 1024;

export type ReadingOptions = Readonly<{
  manifest: Manifest;
  /** Address of the bundle's manifest. */
  base: string;
  /** The surfaces on screen. */
  surfaces: () => readonly ShownSurface[];
  volumes: () => readonly ShownVolume[];
  /** Returns the volume of a channel; null if it is not known yet, or does not exist. */
  source: (tile: string, channel: string) => LevelSource | null;
  /** Resolves with the volume of a channel once it is known; null if it does not exist. */
  sourceOf: (tile: string, channel: string) => Promise<LevelSource | null>;
  /** The measured values of voxels; null if the host does not have them. */
  values: ValuesHost | null;
  /** Returns the nearest place where a ray meets anything else that is shown; null if there is none. */
  pick?: (ray: Ray) => Probed | null;
  /** Returns the planes of slices in front of which the specimen is cut away for an eye. */
  corner?: (eye: Vec3) => readonly ClipPlane[] | undefined;
  onError: (error: unknown) => void;
}>;

export class Reading {
  state: ViewerState;
  /** From um to the scene, in which the surfaces are; null before the first frame. */
  specimen: Matrix4 | null = null;
  /** The cone in which volumes show in disc mode. */
  disc: Cone | null = null;
  private readonly cache: TexelCache;
  private isDisposed = false;

  constructor(
    private readonly options: ReadingOptions,
    state: ViewerState,
  ) {
    this.state = state;
    this.cache = new TexelCache((volume) => new VolumeSource(options.base, volume));
  }

  /** Returns the nearest hit of a ray (um); null if it meets no surface, no volume and no slice. */
  async probe(ray: Ray): Promise<Probed | null> {
    const along = unitRay(ray);
    const surface = this.probeSurfaces(along);
    const clip = this.clipFor(along);
    const { mode } = this.state;
    const disc = mode === "disc" ? this.disc : null;
    const volume = probeVolumes(along, await this.volumesAlong(along), clip, disc);
    const other = this.options.pick?.(along) ?? null;
    const hits = [surface, volume, other].filter((each) => each !== null);
    if (hits.length === 0) return null;
    return hits.reduce((a, b) => (b.distance_um < a.distance_um ? b : a));
  }

  /** Returns a hit at once: of a surface, otherwise of a tile's box. Volumes are ignored. */
  glance(ray: Ray): Probed | null {
    const along = unitRay(ray);
    const clip = this.clipFor(along);
    if (pickTile(along, this.tiles, clip) === null) return null;
    return this.probeSurfaces(along) ?? probeBoxes(along, this.tiles, clip);
  }

  /** Returns a line for each shown channel: its name and its value at a point, on the source's scale. */
  async valuesAt(point: Vec3): Promise<readonly string[]> {
    const tile = this.tileAt(point);
    const lines = await Promise.all(
      this.shownChannels.map(async (channel) => {
        const source = await this.options.sourceOf(tile, channel.id);
        const place = source && nearestIn(source.volume, point);
        if (source === null || place === null) return [];
        const unit = unitOf(this.options.manifest);
        const measured = await this.measuredAt(source.volume, channel.id, place);
        if (measured !== null) return [`${channel.name} ${measuredText(measured, unit)}`];
        const level = await this.orReport(this.cache.best(source));
        const value = level && valueAt(source.volume, level, channel.window, place);
        return value === null ? [] : [`${channel.name} ${valueText(value, channel.window, unit)}`];
      }),
    );
    return lines.flat();
  }

  /** Returns the voxel's measured value; null if the host has no measured values, or can't be reached. */
  private async measuredAt(volume: TileVolume, channel: string, point: Vec3) {
    const { values } = this.options;
    const voxel = values === null || volume.measured === undefined ? null : voxelAt(volume, point);
    if (values === null || voxel === null) return null;
    return values.ask(volume.tile, channel, voxel).catch(() => null);
  }

  /**
   * Returns a key of the mip levels from which values are read. The values at the points change
   * only if the key changes.
   */
  sourcesKey(points: readonly Vec3[]): string {
    const known = points.flatMap((point) => {
      const tile = this.tileAt(point);
      return this.shownChannels.map(({ id }) => {
        const source = this.options.source(tile, id);
        return `${id} ${source && availableLevel(source)}`;
      });
    });
    return known.join();
  }

  /** Returns the clip, including the corner in front of slices as seen from the ray's origin. */
  private clipFor({ origin }: Ray): Clip {
    return { ...this.state.clip, corner: this.options.corner?.(origin) };
  }

  private get tiles() {
    return shownTiles(this.options.manifest.tiles, this.state.isolated);
  }

  private probeSurfaces(along: Ray): Probed | null {
    if (this.specimen === null) return null;
    const clip = this.clipFor(along);
    return probeSurfaces(along, this.options.surfaces(), this.specimen, clip, this.tiles);
  }

  private async volumesAlong(along: Ray): Promise<readonly ProbedVolume[]> {
    const clip = this.clipFor(along);
    const crossed = this.tiles.filter((tile) => pickTile(along, [tile], clip) !== null);
    const found: ProbedVolume[] = [];
    for (const { source, ...shown } of this.options.volumes()) {
      if (!crossed.some(({ id }) => id === shown.tile)) continue;
      const level = await this.orReport(this.cache.available(source, PROBED_TEXELS));
      if (level !== null) found.push({ ...shown, volume: source.volume, level });
    }
    return found;
  }

  private tileAt(point: Vec3): string {
    return tileAt(this.options.manifest, point);
  }

  private get shownChannels() {
    const shown = new Set(this.state.channels.flatMap((c) => (c.shown ? [c.id] : [])));
    return this.options.manifest.channels.filter(({ id }) => shown.has(id));
  }

  /** Returns the promise's value; reports a fault, and then returns null. */
  private async orReport<T>(promise: Promise<T>): Promise<T | null> {
    try {
      return await promise;
    } catch (error) {
      if (!this.isDisposed) this.options.onError(error);
      return null;
    }
  }

  dispose(): void {
    this.isDisposed = true;
    this.cache.dispose();
  }
}
