/**
 * What a ray into the specimen means: the first surface, or what is seen of a volume, or where it
 * enters a tile. All in um, world; nothing counts that is cut away.
 *
 * In a volume the place is where half of what is seen along the ray lies in front: the eye sees it
 * there, whether the volume is a wall or a haze.
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

/** A channel of a marched tile, with texels at hand. */
export type ProbedVolume = Omit<ShownVolume, "source"> &
  Readonly<{ volume: TileVolume; level: VolumeLevel }>;

/** The disc's cone: it shows volumes where the angle's cosine is larger. */
export type Cone = Readonly<{ apex_um: Vector3; axis_um: Vector3; cosine: number }>;

/** `channel`: null where only a tile's box was met. */
export type Probed = Readonly<{
  point: Vec3;
  tile: string;
  channel: string | null;
  distance_um: number;
}>;

const MAX_SAMPLES = 512;
/** Least opacity along a whole ray that the user sees, 0..1. */
const SEEN = 0.1;
const BYTES = [0, 255] as const;
/** Farthest place of a surface outside its volume, in voxels. */
const OUTSIDE_VOXELS = 2;

/** The nearest tile: a point of a surface can lie a little outside all of them. */
export function tileAt({ tiles }: Pick<Manifest, "tiles">, point: Vec3): string {
  const place = new Vector3(...point);
  const distances = tiles.map(({ bounds_um: { min, max } }) =>
    new Box3(new Vector3(...min), new Vector3(...max)).distanceToPoint(place),
  );
  return tiles[distances.indexOf(Math.min(...distances))].id;
}

/** The same ray, its direction of unit length. */
export function unitRay({ origin, direction }: Ray): Ray {
  return { origin, direction: new Vector3(...direction).normalize().toArray() };
}

function pointOn({ origin: o, direction: d }: Ray, t: number): Vec3 {
  return [o[0] + t * d[0], o[1] + t * d[1], o[2] + t * d[2]];
}

/**
 * The nearest point of a surface that is kept. Where the ray comes to the inside of a solid that
 * is cut open, it is the point of the cut.
 *
 * @param ray of unit direction
 * @param specimen from um to the room, in which the meshes are
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

/** Whether the ray leaves the solid here. */
function isInside({ face, object }: Intersection<Mesh>, direction: Vector3): boolean {
  if (!face) return false;
  const normal = face.normal.clone().transformDirection(object.matrixWorld);
  return normal.dot(direction) > 0;
}

/**
 * The place that is seen of the volumes along a ray.
 *
 * @param ray of unit direction
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

/** Opacity of each step through a tile, and the channel that has most of it. */
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

/** Part of the ray inside a volume's box, wherever in the stage it was moved. */
function spanOf(ray: Ray, { matrix, bounds_um }: TileVolume): Span | null {
  const toTile = new Matrix4().fromArray(matrix).invert();
  const origin = new Vector3(...ray.origin).applyMatrix4(toTile);
  const ahead = new Vector3(...pointOn(ray, 1)).applyMatrix4(toTile).sub(origin);
  const local: Ray = { origin: origin.toArray(), direction: ahead.toArray() };
  return boxSpan(AHEAD, local, bounds_um);
}

/** The shortest edge of a texel, um. */
function voxelOf({ bounds_um, size, apron }: TileVolume, texels: readonly number[]): number {
  const edges = size.map((n, i) => {
    const intervals = Math.max(1, n - 1 - 2 * apron);
    const edge = bounds_um.max[i] - bounds_um.min[i];
    return ((edge / intervals) * n) / texels[i];
  });
  return Math.min(...edges.filter((edge) => edge > 0));
}

/** The point, or for one that lies a little outside the volume's box its nearest; null: too far. */
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

/** Where the ray enters the first tile, as far as it is kept. */
export function probeBoxes(ray: Ray, tiles: readonly BoxedTile[], clip: Clip): Probed | null {
  const met = pickTile(ray, tiles, clip);
  if (met === null) return null;
  const { id, distance } = met;
  return { point: pointOn(ray, distance), tile: id, channel: null, distance_um: distance };
}
