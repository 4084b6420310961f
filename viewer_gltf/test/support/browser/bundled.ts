/** A module of the tests with all that it imports, as one classic script for a page. */
import { build } from "vite";

export async function bundled(entry: URL): Promise<string> {
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
