import { afterEach, describe, expect, it, vi } from "vitest";
import { Keeper } from "./keeper";
import { Keys } from "./request_plan";
import type { Content, Store } from "./store";

const FOLDER = "https://host/viewer/";
const PAGE = `${FOLDER}?bundle=cells`;
const BUNDLE = `${FOLDER}cells/`;

const textOf = (body: ArrayBuffer) => new TextDecoder().decode(body);

async function refOf(path: string, text: string) {
  const bytes = new TextEncoder().encode(text);
  const hash = new Uint8Array(await crypto.subtle.digest("SHA-256", bytes));
  const sha256 = [...hash].map((v) => v.toString(16).padStart(2, "0")).join("");
  return { path, sha256, bytes: bytes.length };
}

/** A host of a bundle of one file, and a store in memory. */
async function prepare() {
  const { path, ...file } = await refOf("volumes/one.ktx2", "voxels");
  const list = JSON.stringify({ [path]: file });
  const manifest = JSON.stringify({ files: await refOf("files.json", list) });
  const served: Record<string, string> = {
    [FOLDER]: "page",
    [`${BUNDLE}manifest.json`]: manifest,
    [`${BUNDLE}files.json`]: list,
    [BUNDLE + path]: "voxels",
  };
  vi.stubGlobal("fetch", async (asked: Request | string) => {
    const text = served[new Request(asked).url];
    return new Response(text ?? "", { status: text === undefined ? 404 : 200 });
  });
  const kept = new Map<string, Content>();
  const store = {
    has: (key: string) => kept.has(key),
    get: async (key: string) => {
      const content = kept.get(key);
      return content === undefined ? null : new Response(content.body.slice(0));
    },
    put: async (key: string, content: Content) => void kept.set(key, content),
    retain: async () => {},
    save: async () => {},
  };
  const keys = new Keys(FOLDER);
  const keeper = new Keeper(store as unknown as Store, keys, FOLDER, []);
  const works: Promise<unknown>[] = [];
  const ask = async (url: string) => {
    const answer = await keeper.answer(
      keeper.plan(url, PAGE),
      new Request(url),
      (work) => void works.push(work),
    );
    await Promise.all(works.splice(0));
    return answer.text();
  };
  return { keeper, kept, ask, url: BUNDLE + path, key: keys.file(BUNDLE, file.sha256) };
}

describe("the keeper", () => {
  afterEach(() => vi.unstubAllGlobals());

  it("keeps files that the page requested before the worker served it", async () => {
    const { keeper, kept, url, key } = await prepare();
    await keeper.adopt(PAGE, [{ url, range: null }]);
    expect(textOf(kept.get(key)?.body as ArrayBuffer)).toBe("voxels");
  });

  it("keeps files that it passed on before it knew the bundle's files", async () => {
    const { keeper, kept, ask, url, key } = await prepare();
    expect(await ask(url)).toBe("voxels");
    expect(kept.has(key)).toBe(false);
    await keeper.adopt(PAGE, []);
    expect(textOf(kept.get(key)?.body as ArrayBuffer)).toBe("voxels");
  });

  it("names the requests that need no network: for kept files, and for files outside the bundle", async () => {
    const { keeper, url } = await prepare();
    const asked = [url, `${BUNDLE}manifest.json`, `${BUNDLE}values?at=1`, "https://other/file"];
    const areKept = () =>
      keeper.areKept(
        PAGE,
        asked.map((each) => ({ url: each, range: null })),
      );
    expect(await areKept()).toEqual([false, false, false, true]);
    await keeper.adopt(PAGE, []);
    expect(await areKept()).toEqual([false, true, true, true]);
    await keeper.adopt(PAGE, [{ url, range: null }]);
    expect(await areKept()).toEqual([true, true, true, true]);
    expect(await keeper.areKept(PAGE, [{ url, range: "bytes=0-1" }])).toEqual([true]); // a part of a kept file
  });

  it("answers with the kept file, even if the host has changed it", async () => {
    const { keeper, ask, url } = await prepare();
    await keeper.adopt(PAGE, [{ url, range: null }]);
    vi.stubGlobal("fetch", () => Promise.reject(new TypeError("no network")));
    expect(await ask(url)).toBe("voxels");
  });
});
