import type { Color } from "three";
import { describe, expect, it } from "vitest";
import { sampleManifest } from "../../test/support/fixture/manifest";
import { Backdrop } from "./backdrop";
import { SpecimenScene } from "./specimen_scene";

describe("the outline of a selected tile", () => {
  const outlineOf = (specimenScene: SpecimenScene) => specimenScene.overlays[0];

  it("shows which of several tiles is chosen, and disappears again", () => {
    const specimenScene = new SpecimenScene(sampleManifest(1));
    specimenScene.mark("r0_c1");
    expect(outlineOf(specimenScene).visible).toBe(true);
    specimenScene.mark(null);
    expect(outlineOf(specimenScene).visible).toBe(false);
  });

  it("is not drawn around a specimen of one tile", () => {
    const { tiles, ...manifest } = sampleManifest(1);
    const specimenScene = new SpecimenScene({ ...manifest, tiles: [tiles[0]] });
    specimenScene.mark(tiles[0].id);
    expect(outlineOf(specimenScene).visible).toBe(false);
  });
});

describe("the scene of a light page", () => {
  const specimenScene = new SpecimenScene(sampleManifest(1));
  const backdrop = new Backdrop();
  specimenScene.setTheme("light", backdrop);
  const hexOf = () => (specimenScene.scene.background as Color | null)?.getHexString() ?? "none";

  it("is light on a flat screen, with the specimen's shadow", () => {
    specimenScene.isFlat = true;
    expect([hexOf(), backdrop.mesh.visible]).toEqual(["e3e7ee", true]);
  });

  it("is dark in stereo, where a light background would glare", () => {
    specimenScene.isFlat = false;
    expect([hexOf(), backdrop.mesh.visible]).toEqual(["0b0d12", false]);
  });

  it("has no background if a camera shows the user's own room", () => {
    specimenScene.isSeeThrough = true;
    specimenScene.isFlat = true; // a phone shows one image
    expect([hexOf(), backdrop.mesh.visible]).toEqual(["none", false]);
    specimenScene.isSeeThrough = false;
  });

  it("has the shadow below the shown part, also in another theme", () => {
    specimenScene.fitBackdrop([
      [-1, -0.2, -0.5],
      [0.5, 0.3, 0.5],
    ]);
    const later = new Backdrop();
    specimenScene.setTheme("dark", later);
    expect(backdrop.mesh.parent).toBe(null);
    for (const each of [backdrop, later]) {
      const { uFoot, uGround } = each.mesh.material.uniforms;
      expect(uFoot.value.toArray()).toEqual([-1, -0.5, 0.5, 0.5]);
      expect(uGround.value).toBeLessThan(-0.2);
      expect(uGround.value).toBeGreaterThan(-0.3);
    }
  });

  it("has no shadow while nothing is shown, in any theme", () => {
    const shades = () => {
      const { uShade } = (specimenScene.scene.children.at(-1) as Backdrop["mesh"]).material
        .uniforms;
      return uShade.value;
    };
    expect(shades()).toBeGreaterThan(0);
    specimenScene.fitBackdrop([]);
    expect(shades()).toBe(0);
    specimenScene.setTheme("light", new Backdrop());
    expect(shades()).toBe(0);
    specimenScene.fitBackdrop([[0, 0, 0]]);
    expect(shades()).toBeGreaterThan(0);
  });
});
