import { describe, expect, it } from "vitest";
import { sampleManifest } from "../../test/support/fixture/manifest";
import { Room } from "./scene";

describe("the outline of a chosen tile", () => {
  const outlineOf = (room: Room) => room.overlays[0];

  it("shows which of several tiles is chosen, and goes again", () => {
    const room = new Room(sampleManifest(1));
    room.mark("r0_c1");
    expect(outlineOf(room).visible).toBe(true);
    room.mark(null);
    expect(outlineOf(room).visible).toBe(false);
  });

  it("does not stand round a specimen of one tile, where it would tell nothing", () => {
    const { tiles, ...manifest } = sampleManifest(1);
    const room = new Room({ ...manifest, tiles: [tiles[0]] });
    room.mark(tiles[0].id);
    expect(outlineOf(room).visible).toBe(false);
  });
});
