import type { Group } from "three";
import { expect, it } from "vitest";
import { sampleManifest } from "../../test/support/fixture/manifest";
import type { SurfaceFrame } from "../render/blend_material";
import type { SurfaceLoader } from "./gltf_loader";
import { SurfaceTileset } from "./surface_tileset";
import { FINEST } from "./triangle_budget";

type Inside = Readonly<{
  tiles: { maxDepth: number; errorTarget: number; group: Group };
}>;

const level = (geometricError: number, children: readonly unknown[] = []) => ({
  geometricError,
  children,
});

it("a channel's tiles in view are known by level, and are refined as far as requested", () => {
  const [channel] = sampleManifest(1).channels;
  const triangles = [600, 200, 100]; // finest first, for both tiles
  const tileset = new SurfaceTileset(
    "http://host/bundle/",
    { ...channel, triangles },
    { gltf: {} } as SurfaceLoader,
    {} as SurfaceFrame,
    1,
    () => undefined,
    () => undefined,
    () => undefined,
  );
  const { tiles } = tileset as unknown as Inside;
  const hold = (root: unknown) =>
    Object.defineProperty(tiles, "root", { value: root, configurable: true });
  const chain = level(8e-6, [level(2e-6, [level(0)])]);
  hold({
    children: [
      { ...chain, traversal: { inFrustum: true, error: 40 } },
      { ...chain, traversal: { inFrustum: false, error: 4 } },
    ],
  });
  expect(tileset.inView).toEqual([
    [
      { error_px: 40, triangles: 50 },
      { error_px: 10, triangles: 100 },
      { error_px: 0, triangles: 300 },
    ],
  ]);
  hold({ children: [{ ...chain, traversal: { inFrustum: true, error: Infinity } }] });
  expect(tileset.inView[0].map(({ error_px }) => error_px)).toEqual([Infinity, Infinity, 0]);

  tileset.refine(2, FINEST);
  expect([tiles.maxDepth, tiles.errorTarget]).toEqual([Infinity, 2]);
  tileset.refine(2, { factor: 4, leftOut: 1 });
  // As deep as the second level: the coarsest tiles are at depth 1, and the renderer stops before
  // its maximum.
  expect([tiles.maxDepth, tiles.errorTarget]).toEqual([3, 8]);
  tileset.refine(2, { factor: 1, leftOut: 7 });
  expect(tiles.maxDepth).toBe(2);
});
