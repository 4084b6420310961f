import { describe, expect, it } from "vitest";
import { needsOf } from "./required_decoders";

function glb(document: object): ArrayBuffer {
  const json = new TextEncoder().encode(JSON.stringify(document));
  const file = new Uint8Array(20 + json.length);
  const view = new DataView(file.buffer);
  view.setUint32(0, 0x46546c67, true);
  view.setUint32(4, 2, true);
  view.setUint32(8, file.length, true);
  view.setUint32(12, json.length, true);
  view.setUint32(16, 0x4e4f534a, true);
  file.set(json, 20);
  return file.buffer;
}

const PACKED = { bufferViews: [{}, { extensions: { EXT_meshopt_compression: { buffer: 0 } } }] };
const MAPPED = { textures: [{ extensions: { KHR_texture_basisu: { source: 0 } } }] };

describe("the decoders of a glTF file", () => {
  it("are the ones that its buffers and textures use", () => {
    expect(needsOf(glb({}))).toEqual({ meshopt: false, basis: false });
    expect(needsOf(glb(PACKED))).toEqual({ meshopt: true, basis: false });
    expect(needsOf(glb({ ...PACKED, ...MAPPED }))).toEqual({ meshopt: true, basis: true });
    expect(needsOf(JSON.stringify(MAPPED))).toEqual({ meshopt: false, basis: true });
  });

  it("do not include extensions that it only names", () => {
    const named = { extensionsUsed: ["KHR_texture_basisu"], textures: [{ source: 0 }] };
    expect(needsOf(glb(named)).basis).toBe(false);
  });

  it("are unknown if the file is truncated", () => {
    expect(() => needsOf(glb(PACKED).slice(0, 40))).toThrow();
    expect(() => needsOf(glb(PACKED).slice(0, 10))).toThrow();
  });
});
