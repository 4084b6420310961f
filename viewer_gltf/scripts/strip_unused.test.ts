import { readdir, readFile } from "node:fs/promises";
import { expect, it } from "vitest";
import { asksForFormat, withoutExtensions } from "./strip_unused";

const LOADER = new URL("../node_modules/three/examples/jsm/loaders/GLTFLoader.js", import.meta.url);
const SCHEMAS = new URL("../../schemas/", import.meta.url);
const GLTF_WRITER = new URL("../../pipeline/stereocell/formats/", import.meta.url);

it("keeps the loader's classes for all extensions that the pipeline writes", async () => {
  const code = await readFile(LOADER, "utf8");
  const bare = withoutExtensions(code);
  const registered = (text: string) => text.match(/return new GLTF\w+\( parser\b.*/g) ?? [];
  expect(registered(code).length).toBeGreaterThan(15);
  expect(registered(bare).map((line) => line.replace(/^return new |;$/g, ""))).toEqual([
    "GLTFTextureBasisUExtension( parser )",
    "GLTFMeshoptCompression( parser, EXTENSIONS.EXT_MESHOPT_COMPRESSION )",
  ]);
  const texts = await Promise.all(
    ["gltf.py", "meshopt.py"].map((name) => readFile(new URL(name, GLTF_WRITER), "utf8")),
  );
  const written = new Set(texts.join().match(/"(KHR|EXT)_\w+"/g));
  // The loader reads quantized vertices without a class; it draws without the last two.
  expect([...written].sort()).toEqual([
    '"EXT_mesh_features"',
    '"EXT_meshopt_compression"',
    '"EXT_structural_metadata"',
    '"KHR_mesh_quantization"',
    '"KHR_texture_basisu"',
  ]);
});

it("finds no schema that requires a format", async () => {
  const names = (await readdir(SCHEMAS)).filter((name) => name.endsWith(".schema.json"));
  expect(names.length).toBeGreaterThan(5);
  for (const name of names) {
    expect(asksForFormat(await readFile(new URL(name, SCHEMAS), "utf8")), name).toBe(false);
  }
  expect(asksForFormat('{ "type": "string", "format": "date" }')).toBe(true);
});
