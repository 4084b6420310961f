/** The position of a block of texels: its box in um, and the map from that box to texels. Pure. */
import type { TileVolume } from "../bundle/generated/volumes";
import type { Size3 } from "../bundle/ktx2";

type Vec3 = [number, number, number];

/** The block that several tiles form together. All of them share a lattice and a matrix. */
export type BlockFrame = Readonly<{
  /** Corners of the box, um, before `matrix` is applied. */
  min: Vec3;
  max: Vec3;
  spacing_um: Vec3;
  matrix: readonly number[];
  /** Size in texels, including the apron. */
  size: Size3;
  apron: number;
  /** Position of each tile's first texel in the block, by tile ID. */
  places: ReadonlyMap<string, Size3>;
}>;

function spacingOf({ bounds_um: { min, max }, size, apron }: TileVolume): Vec3 {
  const [x, y, z] = size.map((n, k) => (max[k] - min[k]) / Math.max(1, n - 1 - 2 * apron));
  return [x, y, z];
}

/**
 * Returns the frame of all tiles that share the lattice and the matrix of the first one. Other tiles, such as those
 * that an artist has moved separately, are left out of `places`.
 */
export function frameOf(volumes: readonly TileVolume[]): BlockFrame {
  const [first] = volumes;
  const spacing = spacingOf(first);
  const isAlike = (volume: TileVolume) =>
    volume.apron === first.apron &&
    volume.matrix.every(
      (v, i) => Math.abs(v - first.matrix[i]) <= 1e-6 * Math.max(1, Math.abs(v)),
    ) &&
    spacingOf(volume).every((v, k) => Math.abs(v - spacing[k]) <= 1e-3 * spacing[k]);
  const alike = volumes.filter(isAlike);
  const min = [0, 1, 2].map((k) => Math.min(...alike.map((v) => v.bounds_um.min[k]))) as Vec3;
  const max = [0, 1, 2].map((k) => Math.max(...alike.map((v) => v.bounds_um.max[k]))) as Vec3;
  const cells = (k: number, from: number, to: number) => Math.round((to - from) / spacing[k]);
  const size = [0, 1, 2].map((k) => cells(k, min[k], max[k]) + 1 + 2 * first.apron) as Vec3;
  const places = new Map(
    alike.map(({ tile, bounds_um: b }) => [
      tile,
      // Texture rows run in the direction of -y.
      [cells(0, min[0], b.min[0]), cells(1, b.max[1], max[1]), cells(2, min[2], b.min[2])] as Vec3,
    ]),
  );
  return { min, max, spacing_um: spacing, matrix: first.matrix, size, apron: first.apron, places };
}
