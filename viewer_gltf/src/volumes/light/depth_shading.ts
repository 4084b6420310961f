/**
 * Shading of volumes by each other: surrounding matter dims a place (ambient occlusion), and matter on
 * the way to the lamp throws a shadow.
 *
 * The shading of all volumes is one 3D texture, which the march looks up once for each sample that it
 * lights. A worker computes it from coarse mip levels whenever matter, clip or lamp change. Until it
 * is done, the last texture stays.
 */
import {
  ClampToEdgeWrapping,
  Data3DTexture,
  LinearFilter,
  Matrix4,
  RGFormat,
  UnsignedByteType,
  Vector3,
} from "three";
import { SKIP_BRICK } from "../../bundle/generated/constants";
import type { TileVolume } from "../../bundle/generated/volumes";
import type { MarchClip } from "../../gpu/clip_uniforms";
import type { Vec3 } from "../../math/vec3";
import type { MarchFrame } from "../../voxels/march_frame";
import { textureCorners } from "../../voxels/texture_space";
import type { Packed } from "../../voxels/tile_texture";
import type { VolumeSource } from "../../voxels/volume_source";
import type { Resident } from "../residency";
import type { TileMarch } from "../tile_raymarch";
import { type Cut, type Grid, gridRound, type TileMatter } from "./coarse_matter";
import type { CoarseTexels } from "./coarse_texels";
import { type Shading, ShadingClient } from "./shading_client";

/** Largest number of texels in the coarse mip levels of all volumes together. */
const MAX_TEXELS = 2 ** 23;
/**
 * Radius of the ambient occlusion, in voxel spacings of the coarsest axis; the same as for meshes.
 */
const REACH_VOXELS = 8;
/** Steps of the lamp's direction from the middle of a cube's face to its edge: 2 degrees each. */
const LAMP_STEPS = 24;

export type Marched = Readonly<{ march: TileMarch; packed: Packed; resident: Resident }>;

export class DepthShading {
  private readonly client: ShadingClient;
  private texture: Data3DTexture | null = null;
  private grid: Grid | null = null;
  private strength = 0;
  /** The values that the last request depended on. */
  private requested: readonly unknown[] = [];
  private lamp = "";

  constructor(
    private readonly frame: MarchFrame,
    private readonly coarse: CoarseTexels,
    private readonly onChange: () => void,
    onError: (error: unknown) => void,
  ) {
    this.client = new ShadingClient((shading) => this.show(shading), onError);
  }

  get isLoading(): boolean {
    return this.client.isBusy || this.coarse.isLoading;
  }

  /** Sets the strength of the shading; 0 turns it off and computes nothing. */
  set(strength: number): void {
    this.strength = strength;
    this.frame.uDepthShading.value = this.texture === null ? 0 : strength;
  }

  /**
   * Updates the shading. Call it before every frame.
   *
   * @param towards direction to the lamp in the world
   */
  sync(marched: readonly Marched[], clip: MarchClip, towards: Vector3): void {
    if (this.strength === 0 || marched.length === 0) return;
    const isLeaving = ({ packed, resident }: Marched) =>
      packed.channels.some((id) => !resident.texture.kept.has(id));
    if (marched.some(isLeaving)) return; // another set of channels is being loaded
    const lamp = snapped(towards);
    const tiles = this.matterOf(marched);
    if (tiles === null) return; // `onChange` is called when the matter is available
    const cut = cutOf(clip);
    const key = [
      ...marched.flatMap(({ march, packed }) => [
        march,
        packed.channels.join(),
        march.tables.changes,
      ]),
      ...tiles.flatMap((tile) => tile.channels.map(({ texels }) => texels)),
      JSON.stringify(cut),
    ];
    const isSame =
      key.length === this.requested.length && key.every((v, i) => v === this.requested[i]);
    if (isSame && lamp.join() === this.lamp) return;
    this.lamp = lamp.join();
    if (isSame) {
      this.client.ask({ matter: null, towards: lamp });
      return;
    }
    this.requested = key;
    const grid = gridOver(marched);
    const radius_um =
      REACH_VOXELS * Math.max(...marched.map(({ march }) => coarsestSpacing(march.volume)));
    this.client.ask({ matter: { grid, tiles, cut, radius_um }, towards: lamp });
  }

  /** The matter of the tiles; null while texels are being decoded. */
  private matterOf(marched: readonly Marched[]): readonly TileMatter[] | null {
    const { edge } = gridOver(marched);
    const count = marched.reduce((sum, { packed }) => sum + packed.channels.length, 0);
    const used = new Set<VolumeSource>();
    let isWhole = true;
    const tiles = marched.map(({ march, packed, resident }): TileMatter => {
      const { volume } = march;
      const { low, high } = textureCorners(volume);
      const sources = packed.channels.flatMap((id) => resident.texture.kept.get(id) ?? []);
      const isStreamed = packed.index !== null;
      const level = isStreamed ? null : levelFor(sources, edge, MAX_TEXELS / count);
      const channels = packed.channels.map((_, c) => {
        const alphas = march.tables.opacitiesOf(c);
        if (level === null) return { texels: middles(packed, c), opacities: alphas };
        used.add(sources[c]);
        const texels = this.coarse.get(sources[c], level);
        if (texels === null) isWhole = false;
        return { texels: texels ?? new Uint8Array(0), opacities: alphas };
      });
      const bricks = volume.size.map((n) => Math.ceil(n / SKIP_BRICK));
      const size = level === null ? bricks : volume.levels[level].size;
      const whole = level === null ? volume.size.map((n) => n / SKIP_BRICK) : size;
      return {
        channels,
        size: [size[0], size[1], size[2]],
        whole: [whole[0], whole[1], whole[2]],
        low: asVec3(low.clone().min(high)),
        high: asVec3(low.clone().max(high)),
        toTexture: worldToTexture(march).elements,
        voxel_um: march.voxel_um,
      };
    });
    this.coarse.keep(used);
    return isWhole ? tiles : null;
  }

  private show({ grid, texels }: Shading): void {
    const [x, y, z] = grid.size;
    const image = this.texture?.image;
    if (this.texture !== null && image?.width === x && image.height === y && image.depth === z) {
      this.texture.image.data = texels;
    } else {
      this.texture?.dispose();
      this.texture = shadingTexture(texels, grid);
    }
    this.texture.needsUpdate = true;
    this.grid = grid;
    this.frame.uReached.value = this.texture;
    this.frame.uDepthShading.value = this.strength;
    this.onChange();
  }

  /** Passes the position of the texture to a march. */
  place(march: TileMarch): void {
    if (this.grid !== null) march.placeShading(this.grid.low, this.grid.size, this.grid.edge);
  }

  /** Forgets the volumes after they were removed. */
  forget(): void {
    this.requested = [];
    this.coarse.keep(new Set());
  }

  dispose(): void {
    this.client.dispose();
    this.frame.uDepthShading.value = 0;
    this.texture?.dispose();
    this.texture = null;
  }
}

function shadingTexture(texels: Uint8Array<ArrayBuffer>, { size }: Grid): Data3DTexture {
  const texture = new Data3DTexture(texels, ...size);
  texture.format = RGFormat;
  texture.type = UnsignedByteType;
  texture.minFilter = texture.magFilter = LinearFilter;
  texture.wrapS = texture.wrapT = texture.wrapR = ClampToEdgeWrapping;
  texture.unpackAlignment = 1;
  return texture;
}

function gridOver(marched: readonly Marched[]): Grid {
  const [min, max] = [new Vector3().setScalar(1e30), new Vector3().setScalar(-1e30)];
  for (const { march } of marched) march.growBox(min, max);
  return gridRound({ min: asVec3(min), max: asVec3(max) });
}

/**
 * Returns the mip level for cells with an edge in um. Levels count if they are loaded for all
 * channels and have at most `most` texels. The result is the coarsest of these with texels no
 * larger than the edge, otherwise the finest of these. Null if there is none.
 */
function levelFor(sources: readonly VolumeSource[], edge: number, most: number): number | null {
  const { levels } = sources[0].volume;
  const longest = coarsestSpacing(sources[0].volume);
  const usable = levels.flatMap(({ size: [x, y, z] }, i) =>
    x * y * z <= most && sources.every((source) => source.has(i)) ? [i] : [],
  );
  const small = usable.filter((i) => longest * 2 ** i <= edge);
  return small.at(-1) ?? usable[0] ?? null;
}

function coarsestSpacing({ bounds_um, size, apron }: TileVolume): number {
  return Math.max(
    ...bounds_um.min.map((v, i) => (bounds_um.max[i] - v) / Math.max(1, size[i] - 1 - 2 * apron)),
  );
}

/**
 * The middle of each brick's range of intensities, which is all that is known of streamed volumes.
 */
function middles({ bricks }: Packed, channel: number): Uint8Array {
  const ranges = bricks[channel];
  const made = MIDDLES.get(ranges);
  if (made !== undefined) return made;
  const found = Uint8Array.from({ length: ranges.length / 2 }, (_, i) =>
    Math.round((ranges[2 * i] + ranges[2 * i + 1]) / 2),
  );
  MIDDLES.set(ranges, found);
  return found;
}
/** Cache, because a different array would trigger new shading. */
const MIDDLES = new WeakMap<Uint8Array, Uint8Array>();

function cutOf({ min, max, plane, corner }: MarchClip): Cut {
  return {
    box: { min: asVec3(min), max: asVec3(max) },
    plane: plane.toArray(),
    corner: corner.map((each) => each.toArray()),
  };
}

/** Matrix from the world, um, to texture coordinates. */
function worldToTexture({ volume, toBox }: TileMarch): Matrix4 {
  const { low, high } = textureCorners(volume);
  const { min, max } = volume.bounds_um;
  const size = new Vector3(...max).sub(new Vector3(...min));
  const scale = high.sub(low).divide(size);
  return new Matrix4()
    .makeTranslation(low)
    .multiply(new Matrix4().makeScale(scale.x, scale.y, scale.z))
    .multiply(toBox);
}

/** Rounds a direction to a lattice, so that a trembling head triggers no new shading. */
function snapped(towards: Vector3): Vec3 {
  const most = Math.max(...towards.toArray().map(Math.abs));
  const on = towards.toArray().map((v) => Math.round((v / most) * LAMP_STEPS) / LAMP_STEPS);
  return asVec3(new Vector3(...on).normalize());
}

function asVec3({ x, y, z }: Vector3): Vec3 {
  return [x, y, z];
}
