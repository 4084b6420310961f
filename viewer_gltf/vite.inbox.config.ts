/**
 * The inbox's page: built by itself into the folder of the viewer, so that the two share no chunk. Its code and style
 * lie in a folder of their own, and bundles leave both out.
 */
import { resolve } from "node:path";
import { defineConfig, type Plugin } from "vite";
import { compressAll } from "./scripts/finish_build.ts";

const PAGE = "inbox.html";
const FOLDER = "inbox_assets";

/** Compressed files beside those that shrink. */
function compressPage(): Plugin {
  let folder = "";
  return {
    name: "compress-page",
    apply: "build",
    configResolved(config) {
      folder = resolve(config.root, config.build.outDir);
    },
    async writeBundle(_, bundle) {
      await compressAll(folder, Object.keys(bundle));
    },
  };
}

export default defineConfig({
  base: "./",
  plugins: [compressPage()],
  build: {
    target: "es2022",
    outDir: "dist",
    emptyOutDir: false, // the viewer lies there
    copyPublicDir: false,
    assetsDir: FOLDER,
    modulePreload: false,
    rolldownOptions: { input: PAGE },
  },
});
