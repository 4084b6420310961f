/**
 * Checks the layers of the folders of src/; `npm run lint` runs it. A file may import only from its own folder and from
 * lower layers, including types and tests, and imports must not form a circle. All parts, which are folders with a
 * part.ts, share one layer, and no part imports another. A new part thus needs no line here. No file above the host
 * reaches through it (see reach.ts).
 *
 *   npx tsx scripts/layers.ts
 */
import { readdir, readFile } from "node:fs/promises";
import { dirname, join, normalize } from "node:path";
import { fileURLToPath } from "node:url";
import { reachesOf } from "./reach";

/** The layer of all parts. */
const PARTS = "parts";

/** The layers, lowest first. */
export const LAYERS: readonly string[] = [
  "math",
  "gpu",
  "dom",
  "bundle",
  "state",
  "voxels",
  "render",
  "interaction",
  "probe",
  "marks",
  "panel",
  "xr",
  "host",
  PARTS,
  "live",
  "source",
  "app",
  "inbox",
];

/** A file and a file that it imports; both paths are relative to src/. */
export type Arrow = Readonly<{ from: string; to: string }>;

/**
 * Returns a file's imports of files in src/: static imports, dynamic imports and imports of types.
 * Imports of examples in comments do not count.
 */
export function arrowsOf(from: string, text: string): readonly Arrow[] {
  const addresses = text
    .replace(/^ *\* .*$/gm, "")
    .matchAll(/\b(?:from|import)\s*\(?\s*"(\.{1,2}\/[^"?]+)/g);
  return [...addresses]
    .map(([, address]) => normalize(join(dirname(from), address)))
    .filter((to) => !to.startsWith(".."))
    .map((to) => ({ from, to: /\.\w+$/.test(to) ? to : `${to}.ts` }));
}

const roomOf = (path: string) => path.split("/")[0];

/** Returns the folders that are parts: they have a part.ts, and are not in the list of layers. */
export function partsOf(files: readonly string[]): ReadonlySet<string> {
  const rooms = files.filter((file) => /^\w+\/part\.ts$/.test(file)).map(roomOf);
  return new Set(rooms.filter((room) => !LAYERS.includes(room)));
}

/** Returns the imports that lead to a higher layer, from one part to another, or to a folder in no layer. */
export function against(
  arrows: readonly Arrow[],
  parts: ReadonlySet<string> = new Set(),
): readonly Arrow[] {
  const layerOf = (room: string) => LAYERS.indexOf(parts.has(room) ? PARTS : room);
  return arrows.filter(({ from, to }) => {
    const [here, there] = [roomOf(from), roomOf(to)];
    if (parts.has(here) && parts.has(there)) return here !== there;
    return layerOf(here) === -1 || layerOf(there) === -1 || layerOf(there) > layerOf(here);
  });
}

/** Returns the files above the host, which use it. */
export function usersOfHost(
  files: readonly string[],
  parts: ReadonlySet<string>,
): readonly string[] {
  const lowest = LAYERS.indexOf(PARTS);
  return files.filter((file) => {
    const room = roomOf(file);
    return !file.endsWith(".test.ts") && (parts.has(room) || LAYERS.indexOf(room) > lowest);
  });
}

/** Returns the circles of imports, each as a list of files. */
export function circles(arrows: readonly Arrow[]): readonly (readonly string[])[] {
  const next = new Map<string, string[]>();
  for (const { from, to } of arrows) next.set(from, [...(next.get(from) ?? []), to]);
  const reach = (start: string) => {
    const found = new Set<string>();
    const ahead = [start];
    for (let at = ahead.pop(); at !== undefined; at = ahead.pop()) {
      for (const to of next.get(at) ?? []) {
        if (!found.has(to)) ahead.push(to);
        found.add(to);
      }
    }
    return found;
  };
  const reached = new Map([...next.keys()].map((file) => [file, reach(file)]));
  const inCircle = [...reached].filter(([file, files]) => files.has(file));
  const named = inCircle.map(([file, files]) =>
    [...files].filter((other) => reached.get(other)?.has(file)).sort(),
  );
  return [...new Map(named.map((files) => [files.join(), files])).values()];
}

async function filesOf(src: string): Promise<readonly string[]> {
  const names = await readdir(src, { recursive: true });
  return names.filter((name) => name.endsWith(".ts") && name.includes("/"));
}

async function readTexts(src: string, files: readonly string[]): Promise<Map<string, string>> {
  const texts = await Promise.all(files.map((name) => readFile(join(src, name), "utf8")));
  return new Map(files.map((name, i) => [name, texts[i]]));
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const src = fileURLToPath(new URL("../src", import.meta.url));
  const files = await filesOf(src);
  const texts = await readTexts(src, files);
  const parts = partsOf(files);
  const arrows = [...texts].flatMap(([name, text]) => arrowsOf(name, text));
  const wrong = against(arrows, parts);
  const reaches = usersOfHost(files, parts).flatMap((file) =>
    reachesOf(file, texts.get(file) ?? "").map((reach) => ({ file, ...reach })),
  );
  const round = circles(arrows);
  const lines = [
    ...wrong.map(
      ({ from, to }) => `src/${from}: imports ${to}, which lies in a higher layer or another part`,
    ),
    ...round.map((files) => `src/${files[0]}: in a circle with ${files.slice(1).join(", ")}`),
    ...reaches.map(
      ({ file, line, chain }) =>
        `src/${file}:${line}: ${chain} reaches through the host: ask it, or a service, for the thing itself`,
    ),
    `${arrows.length} imports, ${wrong.length} against the layers, ${round.length} circles, ${reaches.length} chains through the host`,
  ];
  process.stdout.write(`${lines.join("\n")}\n`);
  if (wrong.length + round.length + reaches.length > 0) process.exitCode = 1;
}
