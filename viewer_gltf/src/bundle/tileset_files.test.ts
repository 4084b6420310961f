import { afterEach, describe, expect, it, vi } from "vitest";
import { contentHash, sha256 } from "../../test/support/fixture/swap";
import { checkGlb, checkTileset, contentHashes, TilesetFiles } from "./tileset_files";

const PATH = "channels/A/r0_c0/lod0.glb";

/** A glb file of `found` bytes whose header states `length`. */
function glb(length: number, found: number): Uint8Array {
  const bytes = new Uint8Array(found);
  const view = new DataView(bytes.buffer);
  bytes.set(new TextEncoder().encode("glTF"));
  view.setUint32(4, 2, true);
  view.setUint32(8, length, true);
  return bytes;
}

describe("a surface's file", () => {
  it("has the length that its header states", () => {
    expect(() => checkGlb(glb(40, 40), PATH)).not.toThrow();
    expect(() => checkGlb(glb(40, 28), PATH)).toThrow(`${PATH}: found 28 bytes, expected 40`);
  });

  it("is not a host's error page", () => {
    const page = new TextEncoder().encode("<!doctype html><title>Oops</title>");
    expect(() => checkGlb(page, PATH)).toThrow(
      `${PATH}: found another kind of file, expected a glb surface`,
    );
    expect(() => checkGlb(new Uint8Array(), PATH)).toThrow(
      `${PATH}: found another kind of file, expected a glb surface`,
    );
  });
});

describe("a tileset", () => {
  it("has a version and a root", () => {
    const tileset = { asset: { version: "1.1" }, root: { children: [] } };
    expect(checkTileset(tileset, "t.json")).toBe(tileset);
    const asset = { version: "1.1" };
    const wrongs = [
      null,
      [],
      {},
      { asset },
      { asset, root: null },
      { asset, root: { children: 1 } },
    ];
    for (const wrong of [...wrongs, { asset: {}, root: { children: [] } }]) {
      expect(() => checkTileset(wrong, "t.json")).toThrow(
        "t.json: found JSON without asset.version or root",
      );
    }
  });

  it("may have no children, like an external one of a single surface", () => {
    const tileset = { asset: { version: "1.1" }, root: { content: { uri: "lod0.glb" } } };
    expect(checkTileset(tileset, "finer.json")).toBe(tileset);
  });
});

describe("the hashes of a tileset", () => {
  const content = (uri: string, hash: string) => ({ uri, extras: { "sha-256-128": hash } });
  const tileset = (root: object) => checkTileset({ asset: { version: "1.1" }, root }, "t.json");
  const address = "https://host/b/channels/A/tileset.json";

  it("are collected from all levels, by the surfaces' addresses", () => {
    const finer = { content: content("r0_c0/lod0.glb", "fine") };
    const coarse = { content: content("r0_c0/lod1.glb", "coarse"), children: [finer] };
    expect([...contentHashes(tileset({ children: [coarse] }), "t.json", address)]).toEqual([
      ["https://host/b/channels/A/r0_c0/lod1.glb", "coarse"],
      ["https://host/b/channels/A/r0_c0/lod0.glb", "fine"],
    ]);
  });

  it("are required for all files", () => {
    const bare = { content: { uri: "r0_c0/lod0.glb" } };
    expect(() => contentHashes(tileset({ children: [bare] }), "t.json", address)).toThrow(
      "t.json: r0_c0/lod0.glb has no hash, expected extras.sha-256-128",
    );
  });
});

describe("the files of a tileset", () => {
  const BASE = "https://host/b/?token=1";
  const FOLDER = "https://host/b/channels/A";
  const surface = glb(40, 40);

  afterEach(() => vi.unstubAllGlobals());

  const tile = (uri: string, bytes: Uint8Array, children?: readonly object[]) => ({
    content: { uri, extras: { "sha-256-128": contentHash(bytes) } },
    ...(children === undefined ? {} : { children }),
  });
  const bytesOf = (root: object) =>
    Buffer.from(JSON.stringify({ asset: { version: "1.1" }, geometricError: 1, root }));

  /** Serves a coarsest surface with finer ones in an external tileset, with some files replaced by `changed`. */
  function serve(changed: Readonly<Record<string, Uint8Array>> = {}) {
    const finer = bytesOf(tile("lod0.glb", surface));
    const holder = tile("r0_c0/finer.json", finer);
    const root = bytesOf({ children: [tile("r0_c0/lod1.glb", surface, [holder])] });
    const files: Record<string, Uint8Array> = {
      "tileset.json": root,
      "r0_c0/finer.json": finer,
      "r0_c0/lod1.glb": surface,
      "r0_c0/lod0.glb": surface,
      ...changed,
    };
    const asked: string[] = [];
    vi.stubGlobal("isSecureContext", true);
    vi.stubGlobal("fetch", async (url: string) => {
      asked.push(url);
      const body = files[url.replace(`${FOLDER}/`, "").replace("?token=1", "")];
      return body === undefined
        ? new Response("", { status: 404 })
        : new Response(body as Uint8Array<ArrayBuffer>);
    });
    const path = "channels/A/tileset.json";
    const ref = { path, bytes: root.length, sha256: sha256(root) };
    return { files: new TilesetFiles(BASE, ref), asked };
  }

  it("are found through external tilesets, with the bundle's query", async () => {
    const { files, asked } = serve();
    expect(files.root).toBe(`${FOLDER}/tileset.json`);
    for (const path of ["tileset.json", "r0_c0/finer.json"]) {
      const tileset = await files.fetch(`${FOLDER}/${path}`);
      expect(tileset).toMatchObject({ asset: { version: "1.0" }, geometricError: 1 });
    }
    const bytes = await files.fetch(`${FOLDER}/r0_c0/lod0.glb`);
    expect(new Uint8Array(bytes as ArrayBuffer)).toEqual(surface);
    expect(asked.map((url) => url.replace(FOLDER, ""))).toEqual([
      "/tileset.json?token=1",
      "/r0_c0/finer.json?token=1",
      "/r0_c0/lod0.glb?token=1",
    ]);
  });

  it("are new objects each time, since the renderer changes them", async () => {
    const { files } = serve();
    await files.fetch(files.root);
    const [one, other] = [1, 2].map(() => files.fetch(`${FOLDER}/r0_c0/finer.json`));
    expect(await one).toEqual(await other);
    expect(await one).not.toBe(await other);
  });

  it("are unknown before the tileset that names them was read", async () => {
    const { files } = serve();
    await files.fetch(files.root);
    const address = `${FOLDER}/r0_c0/lod0.glb`;
    await expect(files.fetch(address)).rejects.toThrow("is not in its tileset");
  });

  it("are refused if an external tileset has another hash", async () => {
    const changed = bytesOf(tile("lod0.glb", new Uint8Array(1)));
    const { files } = serve({ "r0_c0/finer.json": changed });
    await files.fetch(files.root);
    await expect(files.fetch(`${FOLDER}/r0_c0/finer.json`)).rejects.toThrow(
      "channels/A/r0_c0/finer.json: expected sha-256-128",
    );
    const address = `${FOLDER}/r0_c0/lod0.glb`;
    await expect(files.fetch(address)).rejects.toThrow("is not in its tileset");
  });

  it("are refused with a clear message if a host's error page replaces an external tileset", async () => {
    const { files } = serve({ "r0_c0/finer.json": Buffer.from("<!doctype html>") });
    await files.fetch(files.root);
    await expect(files.fetch(`${FOLDER}/r0_c0/finer.json`)).rejects.toThrow(
      'channels/A/r0_c0/finer.json: found "<!doctype html>", expected JSON',
    );
  });
});
