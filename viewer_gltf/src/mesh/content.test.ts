import { describe, expect, it } from "vitest";
import { checkGlb, checkTileset, contentHashes } from "./content";

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

describe("the hashes of a tileset", () => {
  const content = (uri: string, hash: string) => ({ uri, extras: { "sha-256-128": hash } });
  const tileset = (root: object) => checkTileset({ asset: { version: "1.1" }, root }, "t.json");
  const address = "https://host/b/channels/A/tileset.json";

  it("are those of all levels, by the surfaces' addresses", () => {
    const finer = { content: content("r0_c0/lod0.glb", "fine") };
    const coarse = { content: content("r0_c0/lod1.glb", "coarse"), children: [finer] };
    expect([...contentHashes(tileset({ children: [coarse] }), "t.json", address)]).toEqual([
      ["https://host/b/channels/A/r0_c0/lod1.glb", "coarse"],
      ["https://host/b/channels/A/r0_c0/lod0.glb", "fine"],
    ]);
  });

  it("are all there", () => {
    const bare = { content: { uri: "r0_c0/lod0.glb" } };
    expect(() => contentHashes(tileset({ children: [bare] }), "t.json", address)).toThrow(
      "t.json: r0_c0/lod0.glb has no hash, expected extras.sha-256-128",
    );
  });
});
