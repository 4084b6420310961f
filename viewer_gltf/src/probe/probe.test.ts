import { BoxGeometry, DoubleSide, Matrix4, Mesh, MeshBasicMaterial, Vector3 } from "three";
import { describe, expect, it } from "vitest";
import type { TileVolume } from "../bundle/generated/volumes";
import type { Box } from "../math/box";
import type { Clip } from "../math/clip";
import type { Ray, Vec3 } from "../math/vec3";
import type { ShownSurface } from "../state/on_screen";
import {
  nearestIn,
  type ProbedVolume,
  probeBoxes,
  probeSurfaces,
  probeVolumes,
  unitRay,
} from "./probe";

const NO_CLIP: Clip = { box: null, plane: null };
const BOUNDS: Box = { min: [0, -100, 0], max: [100, 0, 100] };
const TILES = [
  { id: "r0_c0", bounds_um: BOUNDS },
  { id: "r0_c1", bounds_um: { min: [100, -100, 0], max: [200, 0, 100] } as Box },
];
const FRONT: Ray = { origin: [50, -50, 1000], direction: [0, 0, -1] };
/** From um to the scene: the specimen is turned, small and off-centre. */
const FROM_UM_TO_SCENE = new Matrix4()
  .makeTranslation(0.3, 1.4, -1)
  .multiply(new Matrix4().makeRotationY(0.7))
  .multiply(new Matrix4().makeScale(0.004, 0.004, 0.004));

/** A solid box, given in um and placed in the scene. */
function solid(min: Vector3, max: Vector3, channel: string): ShownSurface {
  const size = max.clone().sub(min);
  const middle = min.clone().add(max).multiplyScalar(0.5);
  const geometry = new BoxGeometry(...size.toArray()).translate(...middle.toArray());
  const mesh = new Mesh(geometry, new MeshBasicMaterial({ side: DoubleSide }));
  mesh.matrixAutoUpdate = false;
  mesh.matrixWorld.copy(FROM_UM_TO_SCENE);
  return { mesh, tile: "r0_c0", channel };
}

function expectNear(found: readonly number[] | undefined, expected: readonly number[]): void {
  expected.forEach((v, i) => {
    expect(found?.[i]).toBeCloseTo(v, 3);
  });
}

describe("a ray at surfaces", () => {
  const near = solid(new Vector3(20, -80, 60), new Vector3(80, -20, 90), "near");
  const far = solid(new Vector3(20, -80, 10), new Vector3(80, -20, 40), "far");
  const probe = (clip: Clip, ray = FRONT) =>
    probeSurfaces(ray, [far, near], FROM_UM_TO_SCENE, clip, TILES);

  it("meets the nearest one, in um", () => {
    const found = probe(NO_CLIP);
    expect(found?.channel).toBe("near");
    expect(found?.tile).toBe("r0_c0");
    expectNear(found?.point, [50, -50, 90]);
    expect(found?.distance_um).toBeCloseTo(910, 2);
  });

  it("passes parts that are cut away, and meets the cut face of a solid", () => {
    const through = probe({ box: { min: [0, -100, 0], max: [100, 0, 50] }, plane: null });
    expect(through?.channel).toBe("far");
    expectNear(through?.point, [50, -50, 40]);
    const opened = probe({ box: null, plane: { normal: [0, 0, 1], offset_um: 75 } });
    expect(opened?.channel).toBe("near");
    expectNear(opened?.point, [50, -50, 75]);
  });

  it("meets nothing beside the surfaces, or where all of them are cut away", () => {
    expect(probe({ box: { min: [0, -100, 0], max: [9, 0, 100] }, plane: null })).toBeNull();
    expect(probe(NO_CLIP, { ...FRONT, origin: [5, -50, 1000] })).toBeNull();
  });
});

describe("a ray at volumes", () => {
  const SIDE = 50;
  /** A volume whose texels are a function of their place in the box, um; without an apron, so texel centres span it. */
  function volumeOf(
    channel: string,
    value: (z_um: number) => number,
    opacity: number,
  ): ProbedVolume {
    const file = { path: "x", bytes: 0, sha256: "" };
    const size = [SIDE, SIDE, SIDE] as [number, number, number];
    const volume: TileVolume = {
      tile: "r0_c0",
      file,
      bricks: file,
      size,
      apron: 0,
      bounds_um: { min: [0, -100, 0], max: [100, 0, 100] },
      matrix: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1],
      levels: [{ size, offset: 0, length: 1, sha256: "" }],
    };
    const texels = new Uint8Array(SIDE ** 3);
    for (let k = 0; k < SIDE; k++) {
      texels.fill(value((100 * k) / (SIDE - 1)), k * SIDE ** 2, (k + 1) * SIDE ** 2);
    }
    const table = new Uint8Array(1024);
    for (let i = 128; i < 256; i++) table[4 * i + 3] = opacity;
    return { tile: "r0_c0", channel, volume, level: { size, texels }, table, isInDisc: false };
  }

  it("ends at an opaque layer that hides the rest", () => {
    const wall = volumeOf("A", (z) => (z < 70 ? 255 : 0), 255);
    const found = probeVolumes(FRONT, [wall], NO_CLIP, null);
    expect(found?.channel).toBe("A");
    expect(Math.abs((found?.point[2] ?? 0) - 70)).toBeLessThan(2.1); // about a voxel
  });

  it("ends in a haze where half of the visible opacity lies in front", () => {
    const haze = volumeOf("A", () => 255, 2);
    const found = probeVolumes(FRONT, [haze], NO_CLIP, null);
    // A voxel of 100 / 49 um transmits q = 1 - 2 / 255 of the light, and all 49 voxels transmit q ** 49.
    const q = 1 - 2 / 255;
    const depth = (Math.log((1 + q ** 49) / 2) / Math.log(q)) * (100 / 49);
    expect(Math.abs(100 - depth - (found?.point[2] ?? 0))).toBeLessThan(2.1);
  });

  it("returns the channel that it meets, and respects the cut and the disc", () => {
    const front = volumeOf("A", (z) => (z > 60 ? 255 : 0), 255);
    const back = volumeOf("B", (z) => (z < 30 ? 255 : 0), 255);
    const both = [back, front];
    expect(probeVolumes(FRONT, both, NO_CLIP, null)?.channel).toBe("A");
    const clip: Clip = { box: null, plane: { normal: [0, 0, 1], offset_um: 40 } };
    expect(probeVolumes(FRONT, both, clip, null)?.channel).toBe("B");
    const aside = {
      apex_um: new Vector3(50, -50, 1000),
      axis_um: new Vector3(1, 0, 0),
      cosine: 0.9,
    };
    const inDisc = [back, { ...front, isInDisc: true }];
    expect(probeVolumes(FRONT, inDisc, NO_CLIP, aside)?.channel).toBe("B");
  });

  it("meets nothing where nothing is visible", () => {
    expect(probeVolumes(FRONT, [volumeOf("A", () => 100, 255)], NO_CLIP, null)).toBeNull();
    expect(probeVolumes(FRONT, [], NO_CLIP, null)).toBeNull();
    const aside: Ray = { origin: [500, -50, 1000], direction: [0, 0, -1] };
    expect(probeVolumes(aside, [volumeOf("A", () => 255, 255)], NO_CLIP, null)).toBeNull();
  });
});

describe("a point near a volume", () => {
  /** A voxel is 1 x 2 x 4 um; the tile was turned and moved. */
  const matrix = new Matrix4().makeTranslation(50, 0, 0).multiply(new Matrix4().makeRotationZ(1.5));
  const volume: TileVolume = {
    tile: "r0_c0",
    file: { path: "a", bytes: 0, sha256: "" },
    bricks: { path: "b", bytes: 0, sha256: "" },
    size: [13, 13, 13],
    apron: 1,
    bounds_um: { min: [0, -20, 0], max: [10, 0, 40] },
    matrix: matrix.toArray(),
    levels: [{ size: [13, 13, 13], offset: 0, length: 1, sha256: "" }],
  };
  const nearest = (point: Vec3) => {
    const world = new Vector3(...point).applyMatrix4(matrix).toArray();
    const found = nearestIn(volume, world);
    return found && new Vector3(...found).applyMatrix4(matrix.clone().invert()).toArray();
  };

  it("is moved to the nearest place inside if it is at most two voxels outside", () => {
    expectNear(nearest([3, -4, 5]) ?? [], [3, -4, 5]);
    expectNear(nearest([11.9, -23.9, 47.9]) ?? [], [10, -20, 40]);
    expect(nearest([12.1, -4, 5])).toBeNull();
    expect(nearest([3, 4.1, 5])).toBeNull();
    expect(nearest([3, -4, -8.1])).toBeNull();
  });
});

describe("a ray at the tiles' boxes", () => {
  it("enters the first one at the part that is not cut away", () => {
    expect(probeBoxes(FRONT, TILES, NO_CLIP)).toMatchObject({
      tile: "r0_c0",
      point: [50, -50, 100],
    });
    const clip: Clip = { box: null, plane: { normal: [0, 0, 1], offset_um: 25 } };
    expect(probeBoxes(FRONT, TILES, clip)?.point).toEqual([50, -50, 25]);
    const along = unitRay({ origin: [1000, -50, 50], direction: [-7, 0, 0] });
    expect(probeBoxes(along, TILES, NO_CLIP)).toMatchObject({ tile: "r0_c1", distance_um: 800 });
    expect(probeBoxes({ ...FRONT, direction: [0, 0, 1] }, TILES, NO_CLIP)).toBeNull();
  });
});
