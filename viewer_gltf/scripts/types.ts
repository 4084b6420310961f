/**
 * TypeScript types of the bundle's JSON files, from the schemas that the pipeline checks too, and the
 * pipeline's constants that the formats depend on. Writes src/bundle/generated/*.ts, which git ignores.
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

/** Integers at the top of a Python module: module, name, meaning. */
const CONSTANTS = [
  [
    "filters/min_max_bricks.py",
    "SKIP_BRICK",
    "Texels along the edge of a brick of empty-space skipping.",
  ],
  [
    "formats/voxel_bvh.py",
    "STREAM_BRICK",
    "Texels along the edge of a brick of /bricks, without apron.",
  ],
] as const;

async function readConstants(): Promise<string> {
  const lines = CONSTANTS.map(async ([module, name, meaning]) => {
    const text = await readFile(new URL(module, PIPELINE), "utf8");
    const value = new RegExp(`^${name} = (\\d+)\\b`, "m").exec(text)?.[1];
    if (value === undefined) throw new Error(`${module}: found no integer ${name}`);
    return `/** ${meaning} From ${module}. */\nexport const ${name} = ${value};\n`;
  });
  return (await Promise.all(lines)).join("\n");
}

/** make goes by dates: what is the same stays as old as it is. */
async function writeChanged(name: string, text: string): Promise<void> {
  const file = new URL(name, OUT);
  const before = await readFile(file, "utf8").catch(() => null);
  if (before !== text) await writeFile(file, text);
}

await mkdir(OUT, { recursive: true });
await writeChanged("constants.ts", await readConstants());
for (const name of ["bundle", "volumes", "transfer2d", "objects"]) {
  const text = await readFile(new URL(`${name}.schema.json`, SCHEMAS), "utf8");
  const schema = toOlderDraft(JSON.parse(text)) as { [key: string]: Json };
  const types = await compile(schema, name, { format: false, unreachableDefinitions: false });
  await writeChanged(`${name}.ts`, types);
}
