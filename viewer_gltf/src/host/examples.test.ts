/**
 * The examples in comments of the sources: they compile, and print what they state. An example is a
 * block of `ts` in a comment. Its relative imports start from the file of the comment. A call of
 * `print` states the printed JSON behind `// `.
 */
import { execFile } from "node:child_process";
import { mkdtemp, readdir, readFile, rm, writeFile } from "node:fs/promises";
import { dirname, join, relative, sep } from "node:path";
import { fileURLToPath } from "node:url";
import { promisify } from "node:util";
import { afterAll, beforeAll, describe, expect, it } from "vitest";

const VIEWER = fileURLToPath(new URL("../../", import.meta.url));
/** Milliseconds that the compiler may take; 8 seconds on a busy machine. */
const COMPILE_MS = 120_000;
const BLOCK = /^[ ]*\* ```ts\n([\s\S]*?)^[ ]*\* ```$/gm;
/** The files of the entry points, which a reader of the viewer meets first. */
const ENTRIES = [
  "app/automation_api.ts",
  "bundle/load.ts",
  "host/form.ts",
  "host/host.ts",
  "host/part.ts",
  "host/parts.ts",
  "state/part_settings.ts",
  "state/signal.ts",
];

type Example = Readonly<{ file: string; text: string }>;

async function findExamples(): Promise<readonly Example[]> {
  const names = await readdir(join(VIEWER, "src"), { recursive: true });
  const files = names.map((name) => name.split(sep).join("/")).filter((name) => /\.ts$/.test(name));
  const found = files.map(async (file) => {
    const source = await readFile(join(VIEWER, "src", file), "utf8");
    const blocks = file.endsWith(".test.ts") ? [] : [...source.matchAll(BLOCK)];
    return blocks.map(([, block]) => ({ file, text: block.replace(/^[ ]*\* ?/gm, "") }));
  });
  return (await Promise.all(found)).flat().toSorted((a, b) => (a.file < b.file ? -1 : 1));
}

const examples = await findExamples();
const runnable = examples.filter(({ text }) => text.includes("print("));

/** Returns the example as a module in `folder`, which hands its prints to the test. */
function moduleOf({ file, text }: Example, folder: string): string {
  const to = relative(folder, join(VIEWER, "src", dirname(file)))
    .split(sep)
    .join("/");
  const imports = text.replace(/(from |import |import\(|module )"\.\.?\//g, (start) =>
    start.replace(/"\.\/$/, `"${to}/`).replace(/"\.\.\/$/, `"${to}/../`),
  );
  return `export const printed: string[] = [];
export const print = (value: unknown) => printed.push(JSON.stringify(value));
${imports}`;
}

describe("the examples in comments", () => {
  let folder = "";
  const pathOf = (example: Example) => join(folder, `example_${examples.indexOf(example)}.ts`);

  beforeAll(async () => {
    folder = await mkdtemp(join(VIEWER, ".examples-"));
    const options = { extends: "../tsconfig.json", include: ["*.ts", "../src/vite-env.d.ts"] };
    const compilerOptions = { noUnusedLocals: false };
    await writeFile(join(folder, "tsconfig.json"), JSON.stringify({ ...options, compilerOptions }));
    for (const example of examples) await writeFile(pathOf(example), moduleOf(example, folder));
  });

  afterAll(() => rm(folder, { recursive: true, force: true }));

  it("belong to each entry point", () => {
    const files = new Set(examples.map(({ file }) => file));
    expect(ENTRIES.filter((file) => !files.has(file))).toEqual([]);
  });

  it("compile", { timeout: COMPILE_MS }, async () => {
    const tsc = join(VIEWER, "node_modules", "typescript", "bin", "tsc");
    const call = promisify(execFile)(process.execPath, [tsc, "-p", folder]);
    const faults = await call.then(
      () => "",
      (error: { stdout: string }) => error.stdout,
    );
    expect(faults).toBe("");
  });

  it.each(runnable)("print what they state: $file", async (example) => {
    const stated = [...example.text.matchAll(/^print\(.*\); \/\/ (.*)$/gm)].map(([, text]) => text);
    const { printed } = await import(/* @vite-ignore */ pathOf(example));
    expect(stated).not.toEqual([]);
    expect(printed).toEqual(stated);
  });
});
