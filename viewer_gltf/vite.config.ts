import { defineConfig } from "vitest/config";

export default defineConfig({
  // Relative addresses: the page works from any folder of any static host.
  base: "./",
  build: { target: "es2022", outDir: "dist", emptyOutDir: true, chunkSizeWarningLimit: 1500 },
  server: { fs: { allow: [".."] } }, // the schemas lie beside this folder
  worker: { format: "es" },
  test: {
    projects: [
      { extends: true, test: { name: "unit", include: ["src/**/*.test.ts"], environment: "node" } },
      {
        extends: true,
        test: {
          name: "browser",
          include: ["test/**/*.test.ts"],
          environment: "node",
          testTimeout: 180_000,
          hookTimeout: 180_000,
          fileParallelism: false, // one software-rendering browser at a time
        },
      },
    ],
  },
});
