import { describe, expect, it } from "vitest";
import { parseJson } from "./fetch";
import { checkManifest, checkVolumes } from "./schema_check";

const FILE = { path: "a/b.json", bytes: 1, sha256: "0".repeat(64) };
const BOUNDS = { min: [0, -1, 0], max: [1, 0, 1] };
const MANIFEST = {
  format: "stereocell-bundle",
  version: 1,
  generator: "stereocell 0.1.0",
  specimen: { name: "s", modality: "MR", bounds_um: BOUNDS },
  tiles: [{ id: "r0_c0", representation: "mesh", bounds_um: BOUNDS }],
  channels: [
    {
      id: "A",
      name: "A",
      color: [1, 0.5, 0],
      window: [0, 10],
      iso_value: null,
      iso_normalized: null,
      threshold_normalized: null,
      surface: "none",
      surface_reason: "",
      level: null,
      transfer_function: "default",
      transfer_functions: ["default"],
      transfer_functions_2d: { names: [], file: FILE },
      lut: FILE,
      tileset: null,
      triangles: [],
      volumes: FILE,
    },
  ],
  files: FILE,
};

describe("the manifest's check", () => {
  it("accepts a manifest of the schema", () => {
    expect(checkManifest(MANIFEST)).toBe(MANIFEST);
  });

  it("reports a wrong format and a wrong version with the found and the expected value", () => {
    expect(() => checkManifest({ ...MANIFEST, format: "tileset" })).toThrow(
      'manifest.json: format is "tileset", expected "stereocell-bundle"',
    );
    expect(() => checkManifest([])).toThrow("format is missing");
    expect(() => checkManifest({ ...MANIFEST, version: 7 })).toThrow(
      "manifest.json: version is 7, expected 1",
    );
  });

  it("names the field that is wrong", () => {
    const channel = { ...MANIFEST.channels[0], color: [1, "green", 0] };
    expect(() => checkManifest({ ...MANIFEST, channels: [channel] })).toThrow(
      /^manifest\.json: channels\.0\.color\.1: .*"string".*"number"/,
    );
    const { tiles, ...rest } = MANIFEST;
    expect(tiles).toHaveLength(1);
    expect(() => checkManifest(rest)).toThrow(/^manifest\.json: .*"tiles"/);
  });

  it("refuses a bundle without channels with a message of one line", () => {
    expect(() => checkManifest({ ...MANIFEST, channels: [] })).toThrow(
      /^manifest\.json: channels is empty, expected at least one channel: build the bundle again$/,
    );
  });

  it("refuses paths that leave the bundle", () => {
    const files = { ...FILE, path: "../secret" };
    expect(() => checkManifest({ ...MANIFEST, files })).toThrow("manifest.json: files.path");
  });
});

describe("other JSON", () => {
  it("is checked by its own schema, for volumes", () => {
    expect(() => checkVolumes({ volumes: [{ tile: "r0_c0" }] }, "channels/A/volumes.json")).toThrow(
      /^channels\/A\/volumes\.json: volumes\.0: /,
    );
  });

  it("is reported as such if it is a host's error page", () => {
    expect(() => parseJson("<!doctype html><title>Oops</title>", "manifest.json")).toThrow(
      'manifest.json: found "<!doctype html>',
    );
  });

  it("is reported as such if it is cut short", () => {
    const text = JSON.stringify(MANIFEST).slice(0, 200);
    expect(() => parseJson(text, "manifest.json")).toThrow(
      /^manifest\.json: found damaged or incomplete JSON \(/,
    );
  });
});
