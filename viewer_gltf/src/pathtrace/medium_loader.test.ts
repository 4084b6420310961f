import { describe, expect, it } from "vitest";
import { type ChannelSources, withVolumes } from "./medium_loader";

type Tiles = ChannelSources["tiles"];
const ONE = new Map([["r0_c0", {}]]) as unknown as Tiles;

describe("a path-traced medium", () => {
  it("consists of the channels that have volumes of their own", () => {
    const channels = [
      { id: "skin", tiles: ONE },
      { id: "bone", tiles: new Map() as Tiles },
      { id: "lost", tiles: null },
    ];
    expect(withVolumes(channels)).toEqual([{ id: "skin", tiles: ONE }]);
  });
});
