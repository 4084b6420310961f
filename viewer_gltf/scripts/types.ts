/**
 * Writes src/bundle/generated/*.ts, which git ignores: types of the bundle's JSON files, from the schemas that the
 * pipeline checks too, and numbers and tables of the pipeline that the viewer needs.
 */
import { mkdir, readFile, writeFile } from "node:fs/promises";
import { compile } from "json-schema-to-typescript";

type Json = null | boolean | number | string | Json[] | { [key: string]: Json };

const SCHEMAS = new URL("../../schemas/", import.meta.url);
const PIPELINE = new URL("../../pipeline/stereocell/", import.meta.url);
const OUT = new URL("../src/bundle/generated/", import.meta.url);

/** The compiler reads tuples as drafts before 2020-12 wrote them, and doubles types whose $ref has siblings. */
function toOlderDraft(node: Json): Json {
  if (Array.isArray(node)) return node.map(toOlderDraft);
  if (node === null || typeof node !== "object") return node;
  if ("$ref" in node) return { $ref: node.$ref };
  const { prefixItems, items, ...rest } = node;
  const mapped = Object.fromEntries(
    Object.entries(rest).map(([key, value]) => [key, toOlderDraft(value)]),
  );
  if (prefixItems !== undefined) {
    return { ...mapped, items: toOlderDraft(prefixItems), additionalItems: false };
  }
  return items === undefined ? mapped : { ...mapped, items: toOlderDraft(items) };
}

/** Names of numbers at the top of Python modules. */
type Names = Readonly<Record<string, readonly string[]>>;

/** The names that each generated file has, by the module that states the numbers. */
const CONSTANTS: Readonly<Record<string, Names>> = {
  "constants.ts": {
    "filters/min_max_bricks.py": ["SKIP_BRICK"],
    "formats/voxel_bvh.py": ["STREAM_BRICK"],
  },
  "opacity.ts": {
    "transfer/opacity.py": [
      ...["SOFT_DEPTH", "LEAST_SHARE", "FOOT", "NEAR_SURFACE", "AT_SURFACE", "IN_BODY", "BRIGHT"],
      ...["AT_SURFACE_OF_MAGNITUDES", "BRIGHT_OF_MAGNITUDES", "BELOW_BODY", "SOLID_BODY"],
      ...["NOISE_REACH", "FAINT", "MAX_SHIFT"],
    ],
  },
  "grey_shapes.ts": {
    "transfer/channel_statistics.py": ["BRIGHT_SHARE"],
    "transfer/mr_grey.py": [
      ...["BANDS", "DARKEST", "LEAST_RANGE", "STEEP", "STEEPEST", "EDGE_FROM", "EDGE_SOFTNESS"],
    ],
  },
};

const readModule = (module: string) => readFile(new URL(module, PIPELINE), "utf8");

/** Reads the numbers of one generated file. An underscore before a name in Python is left out. */
async function readConstants(numbers: Names): Promise<string> {
  const modules = Object.entries(numbers).map(async ([module, names]) => {
    const text = await readModule(module);
    const lines = names.map((name) => {
      const line = new RegExp(`^_?${name} = ([\\d.]+(?:e-?\\d+)?) *(?:#.*)?$`, "m").exec(text);
      if (line === null) throw new Error(`${module}: found no number ${name}`);
      return `export const ${name} = ${line[1]};\n`;
    });
    return `// From ${module}, where the meanings stand.\n${lines.join("")}`;
  });
  return (await Promise.all(modules)).join("\n");
}

const PRESETS = "transfer/presets.py";
const ROW = /^ {4}"(\w+)": Preset\(\s*"([^"\\]+)",\s*"([^"\\]+)",\s*\),$/gm;

/** Reads titles and sentences of the transfer functions that a build makes: two files, since sentences load later. */
async function readPresets(): Promise<Readonly<Record<string, string>>> {
  const text = await readModule(PRESETS);
  const rows = [...text.matchAll(ROW)];
  const found = text.match(/\bPreset\(/g)?.length ?? 0;
  if (rows.length === 0 || rows.length !== found) {
    throw new Error(
      `${PRESETS}: read ${rows.length} of ${found} rows, expected '"name": Preset("title", "sentence"),'`,
    );
  }
  const table = (name: string, column: number) => {
    const cells = Object.fromEntries(rows.map((row) => [row[1], row[column]]));
    const type = "Readonly<Record<string, string>>";
    return `/** From ${PRESETS}. */\nexport const ${name}: ${type} = ${JSON.stringify(cells, null, 2)};\n`;
  };
  return {
    "preset_titles.ts": table("PRESET_TITLES", 2),
    "preset_sentences.ts": table("PRESET_SENTENCES", 3),
  };
}

/** The states that the server reports, by the generated file: the constant and the module with its `Doing`. */
const STATES: Readonly<Record<string, readonly [string, string]>> = {
  "item_states.ts": ["ITEM_STATES", "inbox/item.py"],
  "build_states.ts": ["BUILD_STATES", "live/build_state.py"],
};

/** Reads the values of a module's `Doing = Literal[...]`, a line each. */
async function readStates(name: string, module: string): Promise<string> {
  const rows = /^Doing = Literal\[\n((?: {4}"\w+",.*\n)+)\]$/m.exec(await readModule(module));
  if (rows === null) throw new Error(`${module}: found no Doing, expected 'Doing = Literal['`);
  const values = [...rows[1].matchAll(/^ {4}"(\w+)"/gm)].map((row) => row[1]);
  return `/** From ${module}. */\nexport const ${name} = ${JSON.stringify(values, null, 2)} as const;\n`;
}

/** Writes a file only if its text has changed, because make compares the times of files. */
async function writeChanged(name: string, text: string): Promise<void> {
  const file = new URL(name, OUT);
  const before = await readFile(file, "utf8").catch(() => null);
  if (before !== text) await writeFile(file, text);
}

await mkdir(OUT, { recursive: true });
for (const [file, numbers] of Object.entries(CONSTANTS)) {
  await writeChanged(file, await readConstants(numbers));
}
for (const [name, text] of Object.entries(await readPresets())) await writeChanged(name, text);
for (const [file, [name, module]] of Object.entries(STATES)) {
  await writeChanged(file, await readStates(name, module));
}
for (const name of ["bundle", "volumes", "transfer2d", "objects"]) {
  const text = await readFile(new URL(`${name}.schema.json`, SCHEMAS), "utf8");
  const schema = toOlderDraft(JSON.parse(text)) as { [key: string]: Json };
  const types = await compile(schema, name, { format: false, unreachableDefinitions: false });
  await writeChanged(`${name}.ts`, types);
}
