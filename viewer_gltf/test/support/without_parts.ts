/**
 * Copies the sources of the viewer without some parts: without their folders and their lines of
 * registration.
 */
import { cp, mkdir, readFile, rm, symlink, writeFile } from "node:fs/promises";
import { join } from "node:path";
import { fileURLToPath } from "node:url";
import { build } from "vite";

const VIEWER = fileURLToPath(new URL("../..", import.meta.url));
const COPIED = ["src", "index.html", "public", "package.json", "tsconfig.json"];

/** Matches a line of src/app/parts.ts, with the folder of the part. */
const REGISTERED = /^export .* from "\.\.\/(\w+)\/part";$/gm;
const REGISTRATION = "src/app/parts.ts";

/** Returns the folders of all registered parts, in the order of their lines. */
export async function registeredParts(): Promise<readonly string[]> {
  const text = await readFile(join(VIEWER, REGISTRATION), "utf8");
  return [...text.matchAll(REGISTERED)].map(([, part]) => part);
}

/**
 * Writes the copy to a folder, beside a link to the schemas. Returns the path of the copied viewer.
 *
 * @param kept parts whose folders stay, without their lines
 */
export async function copyWithout(
  parts: readonly string[],
  folder: string,
  kept: readonly string[] = [],
): Promise<string> {
  const copy = join(folder, "viewer_gltf");
  await mkdir(copy, { recursive: true });
  const isSource = (path: string) => !path.endsWith(".test.ts");
  for (const name of COPIED) {
    await cp(join(VIEWER, name), join(copy, name), { recursive: true, filter: isSource });
  }
  await symlink(join(VIEWER, "node_modules"), join(copy, "node_modules"));
  await symlink(join(VIEWER, "..", "schemas"), join(folder, "schemas"));
  const registration = join(copy, REGISTRATION);
  const lines = (await readFile(registration, "utf8")).split("\n");
  const isGone = (line: string) => parts.some((part) => line.includes(`"../${part}/part"`));
  const left = lines.filter((line) => !isGone(line));
  if (lines.length - left.length !== parts.length) {
    throw new Error(`${REGISTRATION}: expected a line for each of ${parts.join(", ")}`);
  }
  await writeFile(registration, left.join("\n"));
  for (const part of parts.filter((each) => !kept.includes(each))) {
    await rm(join(copy, "src", part), { recursive: true });
  }
  const config = { extends: "./tsconfig.json", include: ["src/app/main.ts", "src/vite-env.d.ts"] };
  await writeFile(join(copy, "tsconfig.page.json"), JSON.stringify(config));
  return copy;
}

/** Builds the page of a copy. Returns the folder for a host. */
export async function buildPage(copy: string): Promise<string> {
  const outDir = join(copy, "dist");
  await build({
    ...{ root: copy, base: "./", configFile: false, logLevel: "error" },
    worker: { format: "es" },
    build: { outDir, target: "es2022", minify: false, reportCompressedSize: false },
  });
  return outDir;
}
