import { fileURLToPath } from "node:url";
import type { Plugin } from "vite";
import { defineConfig } from "vitest/config";
import { finishBuild } from "./scripts/finish_build.ts";
import { oneChunk } from "./scripts/one_chunk.ts";
import { OneLast } from "./scripts/one_last.ts";
import { stripUnused } from "./scripts/strip_unused.ts";

const SERVICE_WORKER = "sw.js";
const PAGE = fileURLToPath(new URL("index.html", import.meta.url));

/** Removes the comments of shaders from the build; they remain in the sources. */
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

/** Materials of three.js that the page does not use. */
const UNUSED = new Set([
  ...[
    "background",
    "backgroundCube",
    "cube",
    "equirect",
    "distance",
    "shadow",
    "points",
    "linedashed",
  ],
  ...["meshlambert", "meshmatcap", "meshnormal", "meshphong", "meshtoon"],
]);
/** Features of three.js that the page never uses; the build leaves out parts of shaders that only they need. */
const NEVER =
  /^"#if(def)? (USE_(IRIDESCENCE|ALPHAHASH|BATCHING|BUMPMAP|ENVMAP|FOG|SKINNING|(INSTANCING_)?MORPH\w*)|NUM_(CLIPPING_PLANES|LIGHT_PROBE_GRIDS) > 0)\\n/;

/** Returns whether a part, given as a string's source, is only for an unused feature: its first `#endif` is its end. */
function isNeverUsed(source: string): boolean {
  const end = '\\n#endif"';
  return NEVER.test(source) && source.indexOf(end.slice(0, -1)) === source.length - end.length;
}

/** Parts of shaders that only unused materials need, or that the page's materials never use. */
const UNUSED_PARTS = [
  "lights_lambert_fragment",
  "lights_lambert_pars_fragment",
  "lights_phong_fragment",
  "lights_phong_pars_fragment",
  "lights_toon_fragment",
  "lights_toon_pars_fragment",
  "gradientmap_pars_fragment",
  "shadowmap_pars_fragment",
  "shadowmap_pars_vertex",
  "shadowmap_vertex",
  "transmission_fragment",
  "transmission_pars_fragment",
  "cube_uv_reflection_fragment",
  "shadowmask_pars_fragment",
  "map_particle_fragment",
  "map_particle_pars_fragment",
];

/** Indents, and spaces next to round brackets. Tabs within a line separate words and stay. */
const INDENTS = /(?<=\\n(?:\\t)*)\\t|(?<=\() | (?=\))/g;

/**
 * Removes the shaders of unused materials. A bundler can't do this, because three.js lists all shaders in one object.
 * The other shaders lose their indents.
 */
function stripMaterials(): Plugin {
  return {
    name: "strip-materials",
    apply: "build",
    enforce: "pre",
    transform(code, id) {
      if (!id.endsWith("/three/build/three.module.js")) return;
      const listed = code.matchAll(/^\t(\w+)_(?:vert|frag): (\w+\$\w+),?$/gm);
      const left = new Set([...listed].flatMap(([, of, name]) => (UNUSED.has(of) ? [name] : [])));
      if (left.size !== 2 * UNUSED.size) this.error(`found ${left.size} of three's shaders`);
      for (const part of UNUSED_PARTS) left.add(part);
      const text = /^(const|var) ([\w$]+) = (".*");$/gm;
      return code.replace(text, (line, kind, name, source) =>
        left.has(name) || isNeverUsed(source) ? `${kind} ${name} = "";` : line.replace(INDENTS, ""),
      );
    },
  };
}

/** Removes descriptions and titles from schemas, since no check reads them. */
function stripSchemas(): Plugin {
  return {
    name: "strip-schemas",
    apply: "build",
    enforce: "pre",
    transform(code, id) {
      if (!id.endsWith(".schema.json")) return;
      const bare = JSON.parse(code, (key, value) =>
        /^(description|title)$/.test(key) && typeof value === "string" ? undefined : value,
      );
      return { code: JSON.stringify(bare), map: null };
    },
  };
}

/**
 * Codecs of sources that replace those of numcodecs. The WebAssembly of numcodecs includes the compressors (1.4 MB), and
 * its glue code makes functions from text, which the page's policy forbids.
 */
const CODECS = Object.fromEntries(
  ["blosc", "lz4", "zstd"].map((name) => [
    `numcodecs/${name}`,
    fileURLToPath(new URL(`src/source/codecs/${name}.ts`, import.meta.url)),
  ]),
);

const BUILT = "test/**/*.built.test.ts";

/** Returns a project of tests that open pages in a browser. */
function ofBrowser(name: string, files: { include: string[]; exclude?: string[] }) {
  return {
    extends: true as const,
    test: {
      name,
      ...files,
      environment: "node",
      globalSetup: "test/support/browser/shared_fixture.ts",
      testTimeout: 180_000,
      hookTimeout: 180_000,
      expect: { poll: { timeout: 90_000 } }, // the default, one second, is too short for a busy machine
      // Pages are drawn in software. Two pages at a time, one of each project, are enough for two cores.
      fileParallelism: false,
      isolate: false,
      sequence: { groupOrder: 1 }, // not at the same time as the unit tests
      // On a busy machine a browser may miss a moment, so tests are repeated there. A real fault fails each time.
      retry: process.env.CI === undefined ? 0 : 2,
    },
  };
}

export default defineConfig({
  // Relative addresses: the page works from any folder of any static host.
  base: "./",
  plugins: [stripShaders(), stripMaterials(), stripUnused(), stripSchemas(), finishBuild()],
  build: {
    target: "es2022",
    outDir: "dist",
    emptyOutDir: true,
    chunkSizeWarningLimit: 1500,
    rolldownOptions: {
      output: {
        codeSplitting: {
          groups: [
            { name: oneChunk(PAGE, "index"), priority: 1 },
            { name: "objects", test: /\/src\/objects\// }, // includes code that their section shares with them
            { name: "source_codecs", test: /\/src\/source\/(codecs\/|unpack)|\/zstddec-stream/ },
            { name: "source", test: /\/src\/source\/|\/node_modules\/@?zarrita\// },
          ],
        },
      },
    },
  },
  resolve: { alias: CODECS },
  server: { fs: { allow: [".."] } }, // the schemas are beside this folder
  worker: {
    format: "es",
    rolldownOptions: {
      output: {
        // A service worker may serve only its own folder, so it must be beside index.html and not in assets/.
        entryFileNames: ({ name }) => (name === "sw" ? SERVICE_WORKER : "assets/[name]-[hash].js"),
      },
    },
  },
  test: {
    sequence: { sequencer: OneLast },
    projects: [
      {
        extends: true,
        test: {
          name: "unit",
          include: ["{src,scripts}/**/*.test.ts"],
          environment: "node",
          setupFiles: "test/support/all_parts.ts",
          isolate: false, // modules are then loaded once for all files, which takes most of the time
          testTimeout: 30_000, // the longest test takes a second, and ten times as long on a busy machine
        },
      },
      ofBrowser("browser", { include: ["test/**/*.test.ts"], exclude: [BUILT] }),
      // Tests of bundles that `make test` builds while the other tests run.
      ofBrowser("built", { include: [BUILT] }),
    ],
  },
});
