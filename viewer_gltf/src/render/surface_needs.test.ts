import { Matrix4, MeshStandardMaterial, Texture } from "three";
import { beforeEach, describe, expect, it } from "vitest";
import { Cuts } from "../gpu/clip_planes";
import type { Clip } from "../math/clip";
import { defineNeeds, defineRough } from "./surface_needs";

const NO_CUT: Clip = { box: null, plane: null };
const CORNER = [0, 1, 2].map((k) => ({
  normal: [Number(k === 0), Number(k === 1), Number(k === 2)] as const,
  offset_um: 0,
}));
const TILE = { min: [0, 0, 0], max: [1, 1, 1] } as const;

describe("a surface's shader", () => {
  let cuts: Cuts;
  let material: MeshStandardMaterial;
  let uIsForBoth: { value: boolean };

  beforeEach(() => {
    cuts = new Cuts();
    material = new MeshStandardMaterial();
    uIsForBoth = { value: false };
    defineNeeds(material, { ...cuts, uIsForBoth });
  });

  /** Returns the defines with which three.js would draw the material now, and its version. */
  function drawn(): readonly [defines: readonly string[], version: number] {
    material.onBeforeRender(...([] as unknown as Parameters<typeof material.onBeforeRender>));
    const own = Object.keys(material.defines ?? {}).filter((name) => name !== "STANDARD");
    return [own.sort(), material.version];
  }

  it("discards nothing of an uncut specimen that one eye sees", () => {
    cuts.sync(NO_CUT, new Matrix4());
    cuts.open(null, new Matrix4());
    expect(drawn()[0]).toEqual([]);
  });

  for (const [name, clip] of [
    ["a plane", { box: null, plane: { normal: [1, 0, 0], offset_um: 0 } }],
    ["a box", { box: TILE, plane: null }],
    ["a corner", { ...NO_CUT, corner: CORNER }],
  ] as const) {
    it(`is cut by ${name}, and whole again afterwards`, () => {
      cuts.sync(clip as Clip, new Matrix4());
      expect(drawn()[0]).toEqual(["CUT"]);
      cuts.sync(NO_CUT, new Matrix4());
      expect(drawn()[0]).toEqual([]);
    });
  }

  it("closes surfaces at a tile that is drawn as a volume", () => {
    cuts.open(TILE, new Matrix4());
    expect(drawn()[0]).toEqual(["OPEN"]);
  });

  it("keeps to its eye if it is drawn for both eyes at once", () => {
    uIsForBoth.value = true;
    expect(drawn()[0]).toEqual(["BOTH_EYES"]);
  });

  it("is compiled again only if its needs have changed", () => {
    const [, before] = drawn();
    expect(drawn()[1]).toBe(before);
    cuts.open(TILE, new Matrix4());
    const [, after] = drawn();
    expect(after).toBeGreaterThan(before);
    expect(drawn()[1]).toBe(after);
  });

  for (const [name, parameters, isRough] of [
    ["of roughness 0.5", { roughness: 0.5 }, true],
    ["with some gloss", { roughness: 0.49 }, false],
    ["of metal", { roughness: 0.5, metalness: 0.1 }, false],
    ["whose roughness varies", { roughnessMap: new Texture() }, false],
  ] as const) {
    it(`${isRough ? "needs no" : "needs a"} table of reflected light ${name}`, () => {
      const surface = new MeshStandardMaterial(parameters);
      defineRough(surface);
      expect("ROUGH" in (surface.defines ?? {})).toBe(isRough);
      expect("STANDARD" in (surface.defines ?? {})).toBe(true);
    });
  }
});
