/**
 * Finishes the built page:
 *
 * 1. The viewer's code and style are compressed by gzip into files that the page's own script fetches and
 *    unpacks (boot/load.js), so that any static host sends a third of the bytes. A module in the place of the code
 *    passes its exports on to the parts that load later. The code itself is in a file beside it, for browsers that
 *    can't unpack.
 * 2. The page gets that script, a skeleton that is visible meanwhile (boot/skeleton.css), and the hashes of
 *    both in its policy.
 * 3. The service worker gets the list of the files of this build.
 * 4. Compressed copies (.gz and .br) of all compressible files are written beside them, for servers that send those.
 */
import { createHash } from "node:crypto";
import { readdir, readFile, writeFile } from "node:fs/promises";
import { basename, dirname, extname, join, resolve } from "node:path";
import { promisify } from "node:util";
import { brotliCompress, constants, gzip } from "node:zlib";
import type { Plugin } from "vite";

const SERVICE_WORKER = "sw.js";
const PAGE = "index.html";
const FILES = /(["'`])__VIEWER_FILES__\1/;
const BOOT = new URL("../boot/", import.meta.url);
/** The link to the page's style that Vite writes. */
const STYLE = /<link rel="stylesheet"[^>]* href="\.\/([^"]+\.css)"/;
/** Endings of files that compression makes smaller; other files are already compressed. */
const SHRINKS = new Set([".js", ".css", ".html", ".json", ".svg", ".wasm", ".webmanifest"]);
/** Parts of the page that read a source without a bundle. */
const OF_SOURCES = /(^|\/)source[_-]/;
/** Smallest file that is compressed, bytes; smaller ones fit into a network packet anyway. */
const MIN_BYTES = 1000;

const gzipped = (bytes: Buffer) => promisify(gzip)(bytes, { level: 9 });
const brotlied = (bytes: Buffer) =>
  promisify(brotliCompress)(bytes, {
    params: { [constants.BROTLI_PARAM_SIZE_HINT]: bytes.length },
  });
/** Number of characters at the start of a file that contain its imports. */
const HEAD = 4000;
const hashOf = (text: string) => `'sha256-${createHash("sha256").update(text).digest("base64")}'`;

/** Returns the code in a form that runs from any address; it takes its own address from the page. */
export function movable(code: string, name: string): string {
  const address = `new URL(${JSON.stringify(name)},globalThis.stereocellBase).href`;
  return code
    .replaceAll("import.meta.url", `(${address})`)
    .replaceAll(/import\((["'`])\.\/([^"'`]+)\1\)/g, (_, __, path: string) => {
      return `import(new URL(${JSON.stringify(path)},globalThis.stereocellBase).href)`;
    });
}

/** Returns a module with the exports of the code that the page has fetched; short names include `in` and `do`. */
export function handOn(names: readonly string[]): string {
  const local = names.map((name, i) => `$${i}=code.${name}`);
  const list = names.map((name, i) => `$${i} as ${name}`);
  return `const code=await globalThis.stereocellCode,${local.join()};export{${list.join()}};`;
}

/** Writes the code into a separate file, which is then compressed, and in its old place the module with its exports. */
async function splitCode(
  folder: string,
  entry: string,
  exports: readonly string[],
): Promise<string> {
  const code = movable(await readFile(join(folder, entry), "utf8"), basename(entry));
  const plain = entry.replace(/index(-[^/]*)$/, "viewer$1");
  if (plain === entry) throw new Error(`${entry}: expected a name with index-`);
  const [, needed] = /\bfrom\s*["'`]\.\/([^"'`]+)/.exec(code.slice(0, HEAD)) ?? [];
  if (needed !== undefined)
    throw new Error(`${entry}: needs ${needed} as it starts: it can't move`);
  await writeFile(join(folder, plain), code);
  await writeFile(join(folder, entry), handOn(exports));
  return plain;
}

/** Returns the page's script with the data about code and style that it needs. */
async function scriptFor(folder: string, plain: string, style: string): Promise<string> {
  const code = await readFile(join(folder, plain));
  const build = {
    base: `${dirname(plain)}/`,
    packed: `${plain}.gz`,
    plain,
    packedStyle: `${style}.gz`,
    style,
    bytes: (await gzipped(code)).length,
    lengths: {
      [`${plain}.gz`]: code.length,
      [`${style}.gz`]: (await readFile(join(folder, style))).length,
    },
  };
  const script = await readFile(new URL("load.js", BOOT), "utf8");
  const bare = script.replace(/^ *\/\/.*\n/gm, "").replace(/^ +/gm, "");
  return bare.replace("const BUILD = {}", () => `const BUILD = ${JSON.stringify(build)}`);
}

/**
 * Puts script and skeleton into the page, in place of the elements that load code and style directly. Comments and
 * indentation of the page are left out.
 */
async function writePage(path: string, script: string): Promise<void> {
  const style = (await readFile(new URL("skeleton.css", BOOT), "utf8"))
    .replace(/\/\*.*?\*\//gs, "")
    .replace(/\s+/g, " ")
    .replace(/([{};:,]) | (?=[{}])/g, "$1");
  const skeleton =
    "<div data-boot><main><h1>StereoCell</h1>" +
    '<progress value="0" aria-label="Loading the viewer"></progress><p role="status"></p></main><aside></aside></div>';
  const page = (await readFile(path, "utf8"))
    .replace(/\s*<!--.*?-->/gs, "")
    // The spaces before the end of a script belong to it, and so to its hash.
    .replace(/^ +(?=<(?!\/script>))/gm, "")
    .replace(/\s*<script type="module"[^>]*><\/script>/, "")
    // A disabled link is not fetched. Later parts see from its address that the style is already loaded.
    .replace('<link rel="stylesheet"', "$& disabled")
    .replace("</head>", () => `<style>${style}</style>\n</head>`)
    .replace('<div id="app">', (opening) => `${opening}${skeleton}`)
    .replace("</body>", () => `<script>${script}</script>\n</body>`)
    .replace("script-src 'self'", `script-src 'self' blob: ${hashOf(script)}`)
    .replace("style-src 'self'", `style-src 'self' blob: ${hashOf(style)}`);
  await writeFile(path, page);
}

/** Writes the list of the viewer's files into the service worker, which has a fixed name. */
async function listFiles(folder: string, packed: readonly string[]): Promise<void> {
  const path = join(folder, SERVICE_WORKER);
  const code = await readFile(path, "utf8");
  if (!FILES.test(code)) throw new Error(`${path}: no place for the list of files`);
  const names = (await filesOf(folder))
    .filter((name) => name !== SERVICE_WORKER && name !== PAGE && !packed.includes(name))
    .filter((name) => !OF_SOURCES.test(name)) // a source can be shown only with a network
    .concat(packed.map((name) => `${name}.gz`))
    .sort();
  const list = JSON.stringify(JSON.stringify(names));
  await writeFile(
    path,
    code.replace(FILES, () => list),
  );
}

async function filesOf(folder: string): Promise<string[]> {
  const entries = await readdir(folder, { recursive: true, withFileTypes: true });
  return entries
    .filter((entry) => entry.isFile())
    .map((entry) => join(entry.parentPath, entry.name).slice(folder.length + 1));
}

/** Writes compressed copies of those files that compression makes smaller. */
export async function compressAll(folder: string, files: readonly string[]): Promise<void> {
  const names = files.filter((name) => SHRINKS.has(extname(name)));
  const compress = async (name: string) => {
    const bytes = await readFile(join(folder, name));
    if (bytes.length < MIN_BYTES) return;
    await writeFile(join(folder, `${name}.gz`), await gzipped(bytes));
    await writeFile(join(folder, `${name}.br`), await brotlied(bytes));
  };
  await Promise.all(names.map(compress));
}

export function finishBuild(): Plugin {
  let folder = "";
  return {
    name: "finish-build",
    apply: "build",
    configResolved(config) {
      folder = resolve(config.root, config.build.outDir);
    },
    async writeBundle(_, bundle) {
      if (!(SERVICE_WORKER in bundle)) return; // small pages of the tests have no service worker
      const files = Object.values(bundle);
      const entry = files.find((file) => file.type === "chunk" && file.isEntry);
      const page = join(folder, PAGE);
      // The link in the page names its style; parts that load later have their own styles.
      const [, style] = (await readFile(page, "utf8")).match(STYLE) ?? [];
      if (entry?.type !== "chunk" || style === undefined) throw new Error("no code, or no style");
      const plain = await splitCode(folder, entry.fileName, entry.exports);
      await writePage(page, await scriptFor(folder, plain, style));
      await listFiles(folder, [plain, style]);
      await compressAll(folder, await filesOf(folder));
    },
  };
}
