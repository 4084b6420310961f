/**
 * TypeScript types of the bundle's JSON files, from the schemas that the pipeline checks too.
 * Writes src/bundle/generated/*.ts, which git ignores.
 */
import { mkdir, readFile, writeFile } from "node:fs/promises";
import { compile } from "json-schema-to-typescript";

type Json = null | boolean | number | string | Json[] | { [key: string]: Json };

const SCHEMAS = new URL("../../schemas/", import.meta.url);
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

await mkdir(OUT, { recursive: true });
for (const name of ["bundle", "volumes", "transfer2d"]) {
  const text = await readFile(new URL(`${name}.schema.json`, SCHEMAS), "utf8");
  const schema = toOlderDraft(JSON.parse(text)) as { [key: string]: Json };
  const types = await compile(schema, name, { format: false, unreachableDefinitions: false });
  const file = new URL(`${name}.ts`, OUT);
  // make goes by dates: what is the same stays as old as it is
  const before = await readFile(file, "utf8").catch(() => null);
  if (before !== types) await writeFile(file, types);
}
