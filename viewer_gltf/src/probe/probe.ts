/**
 * Finds the place at which a ray meets the specimen: the first surface, the visible place of a volume, or the entry into
 * a tile. All places are in um, world; parts that are cut away are ignored.
 *
 * In a volume the place is where half of the opacity along the ray lies in front. The eye locates an opaque layer and a
 * haze there.
 */

import { Box3, type Intersection, Matrix4, type Mesh, Raycaster, Vector3 } from "three";
import type { Manifest } from "../bundle/generated/bundle";
import type { TileVolume } from "../bundle/generated/volumes";
import { AHEAD, boxSpan, type Span } from "../math/box";
import { type Clip, clipSpan, isKept } from "../math/clip";
import { type BoxedTile, pickTile } from "../math/pick";
import type { Ray, Vec3 } from "../math/vec3";
import type { ShownSurface, ShownVolume } from "../state/on_screen";
import { type VolumeLevel, valueAt } from "./measure";

/** A channel of a tile whose volume is shown, with its texels. */
export type ProbedVolume = Omit<ShownVolume, "source"> &
  Readonly<{ volume: TileVolume; level: VolumeLevel }>;

/** The disc's cone. It contains points whose angle to the axis has a larger cosine. */
export type Cone = Readonly<{ apex_um: Vector3; axis_um: Vector3; cosine: number }>;

/** A hit of a ray; `channel` is null if only a tile's box was hit. */
export type Probed = Readonly<{
  point: Vec3;
  tile: string;
  channel: string | null;
  distance_um: number;
}>;

const MAX_SAMPLES = 512;
/** Smallest opacity along a whole ray that a user can see, 0..1. */
const SEEN = 0.1;
const BYTES = [0, 255] as const;
/** Largest distance of a surface outside its volume, in voxels. */
const OUTSIDE_VOXELS = 2;

/** Returns the nearest tile, since a point of a surface can lie slightly outside all tiles. */
export function tileAt({ tiles }: Pick<Manifest, "tiles">, point: Vec3): string {
  const place = new Vector3(...point);
  const distances = tiles.map(({ bounds_um: { min, max } }) =>
    new Box3(new Vector3(...min), new Vector3(...max)).distanceToPoint(place),
  );
  return tiles[distances.indexOf(Math.min(...distances))].id;
}

/** Returns the same ray with a direction of unit length. */
export function unitRay({ origin, direction }: Ray): Ray {
  return { origin, direction: new Vector3(...direction).normalize().toArray() };
}

function pointOn({ origin: o, direction: d }: Ray, t: number): Vec3 {
  return [o[0] + t * d[0], o[1] + t * d[1], o[2] + t * d[2]];
}

/**
 * Returns the nearest point of a surface that is not cut away. If the ray first meets the inside of a solid that is cut
 * open, it returns the point on the cut face.
 *
 * @param ray with a direction of unit length
 * @param specimen from um to the scene, in which the meshes are
 */
export function probeSurfaces(
  ray: Ray,
  surfaces: readonly ShownSurface[],
  specimen: Matrix4,
  clip: Clip,
  tiles: readonly BoxedTile[],
): Probed | null {
  const entry = clipSpan(AHEAD, ray, clip);
  if (entry === null) return null;
  const origin = new Vector3(...ray.origin).applyMatrix4(specimen);
  const direction = new Vector3(...ray.direction).transformDirection(specimen);
  const byMesh = new Map(surfaces.map((surface) => [surface.mesh, surface]));
  const caster = new Raycaster(origin, direction);
  caster.layers.enableAll();
  const toSpecimen = specimen.clone().invert();
  for (const hit of caster.intersectObjects<Mesh>([...byMesh.keys()], false)) {
    const found = byMesh.get(hit.object);
    if (found === undefined) continue;
    const point = hit.point.clone().applyMatrix4(toSpecimen).toArray();
    if (!isKept(point, clip)) continue;
    const { tile, channel } = found;
    const bounds = tiles.find(({ id }) => id === tile)?.bounds_um;
    const cut = pointOn(ray, entry[0]);
    const isCut = entry[0] > 0 && isInside(hit, direction) && bounds !== undefined;
    if (isCut && isKept(cut, { box: bounds, plane: null })) {
      return { point: cut, tile, channel, distance_um: entry[0] };
    }
    const distance_um = new Vector3(...point).distanceTo(new Vector3(...ray.origin));
    return { point, tile, channel, distance_um };
  }
  return null;
}

/**
 * Returns whether a ray leaves a solid at an intersection, which is then on the inside of its
 * surface.
 */
function isInside({ face, object }: Intersection<Mesh>, direction: Vector3): boolean {
  if (!face) return false;
  const normal = face.normal.clone().transformDirection(object.matrixWorld);
  return normal.dot(direction) > 0;
}

/**
 * Returns the visible place of the volumes along a ray; null if they are too transparent there.
 *
 * @param ray with a direction of unit length
 */
export function probeVolumes(
  ray: Ray,
  volumes: readonly ProbedVolume[],
  clip: Clip,
  disc: Cone | null,
): Probed | null {
  const samples = [...new Set(volumes.map(({ tile }) => tile))]
    .map((tile) => volumes.filter((volume) => volume.tile === tile))
    .flatMap((channels) => sampleTile(ray, channels, clip, disc))
    .sort((a, b) => a.t - b.t);
  let clear = 1;
  const seen = samples.map(({ alpha }) => {
    clear *= 1 - alpha;
    return 1 - clear;
  });
  const total = 1 - clear;
  if (total < SEEN) return null;
  const { t, tile, channel } = samples[seen.findIndex((sum) => sum >= total / 2)];
  return { point: pointOn(ray, t), tile, channel, distance_um: t };
}

type Sample = Readonly<{ t: number; alpha: number; tile: string; channel: string }>;

/** Returns the opacity of each step through a tile, and the channel with the largest opacity. */
function sampleTile(
  ray: Ray,
  channels: readonly ProbedVolume[],
  clip: Clip,
  disc: Cone | null,
): Sample[] {
  const [{ volume, level, tile }] = channels;
  const span = spanOf(ray, volume);
  const kept = span === null ? null : clipSpan(span, ray, clip);
  if (kept === null) return [];
  const [from, to] = kept;
  const voxel = voxelOf(volume, volume.size);
  const count = Math.ceil((to - from) / voxelOf(volume, level.size));
  const step = (to - from) / Math.min(MAX_SAMPLES, Math.max(1, count));
  const samples: Sample[] = [];
  for (let t = from + step / 2; t < to; t += step) {
    const point = pointOn(ray, t);
    const isInDisc = disc === null || isInCone(point, disc);
    let clear = 1;
    let most = 0;
    let channel = channels[0].channel;
    for (const each of channels) {
      if (each.isInDisc && !isInDisc) continue;
      const value = valueAt(each.volume, each.level, BYTES, point);
      const alpha = value === null ? 0 : each.table[4 * Math.round(value) + 3] / 255;
      if (alpha > most) [most, channel] = [alpha, each.channel];
      clear *= (1 - alpha) ** (step / voxel);
    }
    samples.push({ t, alpha: 1 - clear, tile, channel });
  }
  return samples;
}

/** Returns the part of the ray inside a volume's box, after the stage's transformation of the tile. */
function spanOf(ray: Ray, { matrix, bounds_um }: TileVolume): Span | null {
  const toTile = new Matrix4().fromArray(matrix).invert();
  const origin = new Vector3(...ray.origin).applyMatrix4(toTile);
  const ahead = new Vector3(...pointOn(ray, 1)).applyMatrix4(toTile).sub(origin);
  const local: Ray = { origin: origin.toArray(), direction: ahead.toArray() };
  return boxSpan(AHEAD, local, bounds_um);
}

/** Returns the shortest edge of a texel, um. */
function voxelOf({ bounds_um, size, apron }: TileVolume, texels: readonly number[]): number {
  const edges = size.map((n, i) => {
    const intervals = Math.max(1, n - 1 - 2 * apron);
    const edge = bounds_um.max[i] - bounds_um.min[i];
    return ((edge / intervals) * n) / texels[i];
  });
  return Math.min(...edges.filter((edge) => edge > 0));
}

/** Returns the point, or the nearest one in the volume's box; null if the point is too far outside. */
export function nearestIn(
  { bounds_um, matrix, size, apron }: TileVolume,
  point: Vec3,
): Vec3 | null {
  const toWorld = new Matrix4().fromArray(matrix);
  const inTile = new Vector3(...point).applyMatrix4(toWorld.clone().invert());
  const min = new Vector3(...bounds_um.min);
  const max = new Vector3(...bounds_um.max);
  const nearest = inTile.clone().clamp(min, max);
  const intervals = size.map((n) => Math.max(1, n - 1 - 2 * apron));
  const voxel = max.sub(min).divide(new Vector3(...intervals));
  const outside = inTile.sub(nearest).toArray();
  const isNear = voxel.toArray().every((edge, i) => Math.abs(outside[i]) <= OUTSIDE_VOXELS * edge);
  return isNear ? nearest.applyMatrix4(toWorld).toArray() : null;
}

function isInCone(point: Vec3, { apex_um, axis_um, cosine }: Cone): boolean {
  const from = new Vector3(...point).sub(apex_um);
  return from.dot(axis_um) > cosine * from.length();
}

/** Returns the place where the ray enters the first tile that is not cut away there. */
export function probeBoxes(ray: Ray, tiles: readonly BoxedTile[], clip: Clip): Probed | null {
  const entered = pickTile(ray, tiles, clip);
  if (entered === null) return null;
  const { id, distance } = entered;
  return { point: pointOn(ray, distance), tile: id, channel: null, distance_um: distance };
}
