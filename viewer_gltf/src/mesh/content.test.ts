import { describe, expect, it } from "vitest";
import { checkGlb, checkTileset } from "./content";

const PATH = "channels/A/r0_c0/lod0.glb";

/** The header says `length`; the file has `found` bytes. */
function glb(length: number, found: number): Uint8Array {
  const bytes = new Uint8Array(found);
  const view = new DataView(bytes.buffer);
  bytes.set(new TextEncoder().encode("glTF"));
  view.setUint32(4, 2, true);
  view.setUint32(8, length, true);
  return bytes;
}

describe("a surface's file", () => {
  it("is as long as its header says", () => {
    expect(() => checkGlb(glb(40, 40), PATH)).not.toThrow();
    expect(() => checkGlb(glb(40, 28), PATH)).toThrow(`${PATH}: expected 40 bytes, found 28`);
  });

  it("is no host's page", () => {
    const page = new TextEncoder().encode("<!doctype html><title>Oops</title>");
    expect(() => checkGlb(page, PATH)).toThrow(`${PATH}: expected a glb surface`);
    expect(() => checkGlb(new Uint8Array(), PATH)).toThrow(`${PATH}: expected a glb surface`);
  });
});

describe("a tileset", () => {
  it("has a version and a root", () => {
    const tileset = { asset: { version: "1.1" }, root: { children: [] } };
    expect(checkTileset(tileset, "t.json")).toBe(tileset);
    for (const wrong of [null, [], {}, { asset: {}, root: { children: [] } }]) {
      expect(() => checkTileset(wrong, "t.json")).toThrow("t.json: expected a 3D Tiles tileset");
    }
  });
});
