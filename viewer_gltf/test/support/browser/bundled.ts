/** Bundles a module of the tests with all its imports as one classic script for a page. */
import { build } from "vite";

/** Scripts by their entry. Several test files share a harness, and each build takes seconds. */
const scripts = new Map<string, Promise<string>>();

export function bundled(entry: URL): Promise<string> {
  const known = scripts.get(entry.href);
  if (known !== undefined) return known;
  const script = bundle(entry);
  scripts.set(entry.href, script);
  return script;
}

async function bundle(entry: URL): Promise<string> {
  const built = await build({
    configFile: false,
    logLevel: "error",
    build: {
      write: false,
      target: "es2022",
      lib: { entry: entry.pathname, formats: ["iife"], name: "exported" },
    },
  });
  for (const { output } of [built].flat() as { output: { type: string; code?: string }[] }[]) {
    const code = output.find(({ type }) => type === "chunk")?.code;
    if (code !== undefined) return code;
  }
  throw new Error(`nothing was built of ${entry}`);
}
