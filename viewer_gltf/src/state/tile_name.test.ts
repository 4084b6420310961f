import { describe, expect, it } from "vitest";
import { shortTileName, tileName, tileTitle } from "./tile_name";

describe("a tile's name", () => {
  it("is its row and column, counted from one, or its id", () => {
    expect(tileName("r0_c3", [])).toBe("row 1, column 4");
    expect(tileName("r12_c0", [])).toBe("row 13, column 1");
    expect(tileName("Cortex", [])).toBe("Cortex");
    expect(tileName("r0_c3_b1", [])).toBe("r0_c3_b1"); // not a name of the grid
    expect(shortTileName("r0_c3")).toBe("1·4");
    expect(shortTileName("Cortex")).toBe("Cortex");
  });

  it("includes the layer if a block is cut in depth", () => {
    expect(tileName("r0_c3_z1", [])).toBe("row 1, column 4, layer 2");
    expect(shortTileName("r0_c3_z1")).toBe("1·4·2");
  });

  it("is the one that the stage gives it, if any", () => {
    const tiles = [{ id: "r0_c3", name: "Left half" }, { id: "r0_c4" }];
    expect(tileName("r0_c3", tiles)).toBe("Left half");
    expect(tileTitle("r0_c3", tiles)).toBe("Left half");
    expect(tileTitle("r0_c4", tiles)).toBe("Tile in row 1, column 5");
  });
});
