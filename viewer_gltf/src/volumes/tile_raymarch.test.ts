/** The shader has the code of a fade and of depth shading exactly while they are needed. */
import { Data3DTexture, DepthTexture } from "three";
import { describe, expect, it } from "vitest";
import type { TileVolume } from "../bundle/generated/volumes";
import { makeFrame } from "../voxels/march_frame";
import type { Packed } from "../voxels/tile_texture";
import { TileMarch } from "./tile_raymarch";

const FILE = { path: "v.ktx2", bytes: 0, sha256: "" };
const VOLUME: TileVolume = {
  tile: "r0_c0",
  file: FILE,
  bricks: FILE,
  size: [8, 8, 8],
  apron: 1,
  bounds_um: { min: [0, 0, 0], max: [1, 1, 1] },
  matrix: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1],
  levels: [{ size: [8, 8, 8], offset: 0, length: 0, sha256: "" }],
};

function level(number: number): Packed {
  const texture = new Data3DTexture();
  return { channels: ["DNA"], level: number, texture, index: null, bricks: [], cells: null };
}

describe("the march of a tile", () => {
  const march = new TileMarch(VOLUME, 1, makeFrame(new DepthTexture(1, 1)));
  const { material } = march.mesh;
  const defined = () => Object.keys(material.defines);

  it("blends two levels only while one fades in over the other", () => {
    const [coarse, fine] = [level(1), level(0)];
    march.show(coarse, null, 1, 0.5);
    expect(defined()).not.toContain("FADES");

    march.show(fine, coarse, 0.3, 1);
    expect(defined()).toContain("FADES");
    expect(material.uniforms.uOldVolume.value).toBe(coarse.texture);

    march.show(fine, null, 1, 1);
    expect(defined()).not.toContain("FADES");
    expect(material.uniforms.uOldVolume.value).toBe(fine.texture);
  });

  it("is compiled again only when the code changes", () => {
    const { version } = material;
    march.setShaded(true);
    expect(defined()).toContain("SHADED");
    expect(material.version).toBe(version + 1);
    march.setShaded(true);
    expect(material.version).toBe(version + 1);
    march.setShaded(false);
    expect(defined()).not.toContain("SHADED");
  });
});
