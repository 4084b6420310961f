import { readdir, readFile, writeFile } from "node:fs/promises";
import { join } from "node:path";
import type { Plugin } from "vite";
import { defineConfig } from "vitest/config";

const SERVICE_WORKER = "sw.js";
const PLACEHOLDER = /(["'`])__VIEWER_FILES__\1/;

/** Tell the service worker, which has a fixed name, what the viewer of this build consists of. */
function listViewerFiles(): Plugin {
  let folder = "";
  return {
    name: "list-viewer-files",
    apply: "build",
    configResolved(config) {
      folder = join(config.root, config.build.outDir);
    },
    async writeBundle(_, bundle) {
      if (!(SERVICE_WORKER in bundle)) return; // the tests' own small pages have none
      const path = join(folder, SERVICE_WORKER);
      const code = await readFile(path, "utf8");
      if (!PLACEHOLDER.test(code)) this.error(`${path}: no place for the list of files`);
      const entries = await readdir(folder, { recursive: true, withFileTypes: true });
      const names = entries
        .filter((entry) => entry.isFile())
        .map((entry) => join(entry.parentPath, entry.name).slice(folder.length + 1))
        .filter((name) => name !== SERVICE_WORKER && name !== "index.html")
        .sort();
      const list = JSON.stringify(JSON.stringify(names));
      await writeFile(
        path,
        code.replace(PLACEHOLDER, () => list),
      );
    },
  };
}

/** Shaders travel without their comments: the reader has the sources. */
function stripShaders(): Plugin {
  return {
    name: "strip-shaders",
    apply: "build",
    enforce: "post",
    transform(code, id) {
      if (!id.endsWith(".glsl?raw")) return;
      const text: unknown = JSON.parse(code.replace(/^export default /, "").replace(/;?\s*$/, ""));
      if (typeof text !== "string") this.error(`${id}: expected the text of a shader`);
      const bare = (text as string).replace(/\/\/.*$/gm, "").replace(/^[ \t]+|[ \t]+$/gm, "");
      return { code: `export default ${JSON.stringify(bare.replace(/\n+/g, "\n"))}`, map: null };
    },
  };
}

export default defineConfig({
  // Relative addresses: the page works from any folder of any static host.
  base: "./",
  plugins: [listViewerFiles(), stripShaders()],
  build: { target: "es2022", outDir: "dist", emptyOutDir: true, chunkSizeWarningLimit: 1500 },
  server: { fs: { allow: [".."] } }, // the schemas lie beside this folder
  worker: {
    format: "es",
    rolldownOptions: {
      output: {
        // Its folder is what a service worker may serve: beside index.html, not in assets/.
        entryFileNames: ({ name }) => (name === "sw" ? SERVICE_WORKER : "assets/[name]-[hash].js"),
      },
    },
  },
  test: {
    projects: [
      {
        extends: true,
        test: {
          name: "unit",
          include: ["{src,scripts}/**/*.test.ts"],
          environment: "node",
          isolate: false, // modules are read once for all files, which is most of what they take
          testTimeout: 30_000, // on a busy machine the longest takes ten times its second
        },
      },
      {
        extends: true,
        test: {
          name: "browser",
          include: ["test/**/*.test.ts"],
          environment: "node",
          globalSetup: "test/support/browser/shared_fixture.ts",
          testTimeout: 180_000,
          hookTimeout: 180_000,
          expect: { poll: { timeout: 20_000 } }, // its usual second is short for a busy machine
          fileParallelism: false, // one software-rendering page at a time
          isolate: false,
          // where others have the cores a browser may miss a moment; what is wrong is wrong twice
          retry: process.env.CI === undefined ? 0 : 1,
        },
      },
    ],
  },
});
