/** A copy of the viewer's sources from which parts were removed: each part's folder, and its line of registration. */
import { cp, mkdir, readFile, rm, symlink, writeFile } from "node:fs/promises";
import { join } from "node:path";
import { fileURLToPath } from "node:url";
import { build } from "vite";

const VIEWER = fileURLToPath(new URL("../..", import.meta.url));
const COPIED = ["src", "index.html", "public", "package.json", "tsconfig.json"];

/** Writes the copy to a folder, beside a link to the schemas. Returns the path of the copied viewer. */
export async function copyWithout(parts: readonly string[], folder: string): Promise<string> {
  const copy = join(folder, "viewer_gltf");
  await mkdir(copy, { recursive: true });
  const isSource = (path: string) => !path.endsWith(".test.ts");
  for (const name of COPIED) {
    await cp(join(VIEWER, name), join(copy, name), { recursive: true, filter: isSource });
  }
  await symlink(join(VIEWER, "node_modules"), join(copy, "node_modules"));
  await symlink(join(VIEWER, "..", "schemas"), join(folder, "schemas"));
  const registration = join(copy, "src/app/parts.ts");
  const lines = (await readFile(registration, "utf8")).split("\n");
  const isGone = (line: string) => parts.some((part) => line.includes(`"../${part}/part"`));
  const kept = lines.filter((line) => !isGone(line));
  if (lines.length - kept.length !== parts.length) {
    throw new Error(`src/app/parts.ts: expected a line for each of ${parts.join(", ")}`);
  }
  await writeFile(registration, kept.join("\n"));
  for (const part of parts) await rm(join(copy, "src", part), { recursive: true });
  const config = { extends: "./tsconfig.json", include: ["src/app/main.ts", "src/vite-env.d.ts"] };
  await writeFile(join(copy, "tsconfig.page.json"), JSON.stringify(config));
  return copy;
}

/** Builds the page of a copy. Returns the folder that a host serves. */
export async function buildPage(copy: string): Promise<string> {
  const outDir = join(copy, "dist");
  await build({
    ...{ root: copy, base: "./", configFile: false, logLevel: "error" },
    worker: { format: "es" },
    build: { outDir, target: "es2022", minify: false, reportCompressedSize: false },
  });
  return outDir;
}
