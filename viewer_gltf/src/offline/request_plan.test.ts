import { describe, expect, it } from "vitest";
import { isKept, Keys, MAX_KEPT_USDZ_BYTES, ownBundle, planFor } from "./request_plan";

const FOLDER = "https://host/cells/";
const FIXED = ["app.webmanifest", "icon.svg"];
const plan = (address: string, page: string | null = FOLDER) =>
  planFor(address, FOLDER, page, FIXED);

it("the offline store keeps all files of a bundle except large ones that no page draws", () => {
  const large = MAX_KEPT_USDZ_BYTES + 1;
  expect(isKept({ path: "volumes/a.ktx2", bytes: large })).toBe(true);
  expect(isKept({ path: "specimen.usdz", bytes: large })).toBe(false);
  expect(isKept({ path: "specimen.usdz", bytes: MAX_KEPT_USDZ_BYTES })).toBe(true);
  expect(isKept(null)).toBe(false);
});

describe("the answer to a request", () => {
  it("is the page for its folder and its file, with any query", () => {
    for (const address of [FOLDER, `${FOLDER}?mode=tile`, `${FOLDER}index.html?x=1`]) {
      expect(plan(address, null)).toEqual({ kind: "page" });
    }
    expect(plan("https://host/cells/other.html", null)).toEqual({ kind: "none" });
    expect(plan("https://host/cells/report/", null)).toEqual({ kind: "none" });
  });

  it("distinguishes the viewer's own files from the bundle's", () => {
    expect(plan(`${FOLDER}assets/index-a1.js`)).toEqual({
      kind: "asset",
      name: "assets/index-a1.js",
    });
    expect(plan(`${FOLDER}icon.svg`)).toEqual({ kind: "fixed", name: "icon.svg" });
    expect(plan(`${FOLDER}manifest.json`)).toEqual({ kind: "manifest", base: FOLDER });
    expect(plan(`${FOLDER}luts/a%20b.ktx2`)).toEqual({
      kind: "file",
      base: FOLDER,
      path: "luts/a b.ktx2",
    });
  });

  it("knows a bundle in another folder of the host, with its query", () => {
    const page = `${FOLDER}?bundle=${encodeURIComponent("../other/?token=1")}`;
    const base = "https://host/other/?token=1";
    expect(plan("https://host/other/manifest.json?token=1", page)).toEqual({
      kind: "manifest",
      base,
    });
    expect(plan("https://host/other/a/lod3.glb?token=1", page)).toEqual({
      kind: "file",
      base,
      path: "a/lod3.glb",
    });
    expect(plan("https://host/elsewhere/a.glb", page)).toEqual({ kind: "none" });
  });

  it("leaves bundles of other hosts alone", () => {
    const page = `${FOLDER}?bundle=https://far/x/`;
    expect(ownBundle(page)).toBeNull();
    expect(ownBundle(`${FOLDER}?bundle=http://`)).toBeNull();
    expect(ownBundle("blob:https://host/5f0e")).toBeNull();
    expect(ownBundle(`${FOLDER}?source=x.zarr`)).toBeNull(); // a source is read again at each visit
    expect(plan("https://far/x/manifest.json", page)).toEqual({ kind: "none" });
    expect(plan(`${FOLDER}manifest.json`, page)).toEqual({ kind: "none" });
  });
});

describe("the store's keys", () => {
  const keys = new Keys(FOLDER);

  it("differ by bundle, content and range", () => {
    const all = [
      keys.file("https://host/a/", "00ff"),
      keys.file("https://host/b/", "00ff"),
      keys.file("https://host/a/", "00ee"),
      keys.file("https://host/a/", "00ff", "bytes=0-9"),
      keys.manifest("https://host/a/"),
      keys.page,
      keys.ledger,
    ];
    expect(new Set(all).size).toBe(all.length);
    for (const key of all) expect(new URL(key).href).toBe(key);
  });

  it("contain the hash", () => {
    const key = keys.file("https://host/a/?t=/1", "00ff", "bytes=0-9");
    expect(key.startsWith(keys.files("https://host/a/?t=/1"))).toBe(true);
    expect(keys.hashOf(key)).toBe("00ff");
  });
});
