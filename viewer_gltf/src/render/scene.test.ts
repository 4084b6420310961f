import type { Color } from "three";
import { describe, expect, it } from "vitest";
import { sampleManifest } from "../../test/support/fixture/manifest";
import { Backdrop } from "./backdrop";
import { Room } from "./scene";

describe("the outline of a selected tile", () => {
  const outlineOf = (room: Room) => room.overlays[0];

  it("shows which of several tiles is chosen, and disappears again", () => {
    const room = new Room(sampleManifest(1));
    room.mark("r0_c1");
    expect(outlineOf(room).visible).toBe(true);
    room.mark(null);
    expect(outlineOf(room).visible).toBe(false);
  });

  it("is not drawn around a specimen of one tile", () => {
    const { tiles, ...manifest } = sampleManifest(1);
    const room = new Room({ ...manifest, tiles: [tiles[0]] });
    room.mark(tiles[0].id);
    expect(outlineOf(room).visible).toBe(false);
  });
});

describe("the scene of a light page", () => {
  const room = new Room(sampleManifest(1));
  const backdrop = new Backdrop();
  room.setTheme("light", backdrop);
  const hexOf = () => (room.scene.background as Color | null)?.getHexString() ?? "none";

  it("is light on a flat screen, with the specimen's shadow", () => {
    room.isFlat = true;
    expect([hexOf(), backdrop.mesh.visible]).toEqual(["e3e7ee", true]);
  });

  it("is dark in stereo, where a light background would glare", () => {
    room.isFlat = false;
    expect([hexOf(), backdrop.mesh.visible]).toEqual(["0b0d12", false]);
  });

  it("is empty if a camera shows the user's own room", () => {
    room.isSeeThrough = true;
    room.isFlat = true; // a phone shows one image
    expect([hexOf(), backdrop.mesh.visible]).toEqual(["none", false]);
    room.isSeeThrough = false;
  });

  it("has the shadow below the shown part, also in another theme", () => {
    room.fitBackdrop([
      [-1, -0.2, -0.5],
      [0.5, 0.3, 0.5],
    ]);
    const later = new Backdrop();
    room.setTheme("dark", later);
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
      const { uShade } = (room.scene.children.at(-1) as Backdrop["mesh"]).material.uniforms;
      return uShade.value;
    };
    expect(shades()).toBeGreaterThan(0);
    room.fitBackdrop([]);
    expect(shades()).toBe(0);
    room.setTheme("light", new Backdrop());
    expect(shades()).toBe(0);
    room.fitBackdrop([[0, 0, 0]]);
    expect(shades()).toBeGreaterThan(0);
  });
});
