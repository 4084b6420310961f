/**
 * Builds the inbox's page separately into the folder of the viewer, so that the two share no chunk. Its code and style
 * are in their own folder, and bundles leave both out.
 */
import { resolve } from "node:path";
import { defineConfig, type Plugin } from "vite";
import { compressAll } from "./scripts/finish_build.ts";

const PAGE = "inbox.html";
const FOLDER = "inbox_assets";

/** Writes compressed copies of files that compression makes smaller. */
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
    emptyOutDir: false, // the folder contains the viewer
    copyPublicDir: false,
    assetsDir: FOLDER,
    modulePreload: false,
    rolldownOptions: { input: PAGE },
  },
});
