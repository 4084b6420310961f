/**
 * The folders of src/ lie in layers: a file imports from its own folder and from those below, types
 * and tests too, and no import leads round in a circle. `npm run lint` holds it by this.
 *
 *   npx tsx scripts/layers.ts
 */
import { readdir, readFile } from "node:fs/promises";
import { dirname, join, normalize } from "node:path";
import { fileURLToPath } from "node:url";

/** From the lowest. */
export const LAYERS: readonly string[] = [
  "math",
  "gpu",
  "dom",
  "bundle",
  "state",
  "volumes",
  "surfaces",
  "pathtrace",
  "render",
  "interaction",
  "probe",
  "marks",
  "panel",
  "xr",
  "host",
  "annotations",
  "slices",
  "objects",
  "capture",
  "share",
  "stereo",
  "tap_card",
  "messages",
  "notebook",
  "offline",
  "bench",
  "page",
  "app",
];

/** A file and one that it imports, below src/. */
export type Arrow = Readonly<{ from: string; to: string }>;

/** The imports of a file that lead to files of src/: static ones, dynamic ones, of types alone. */
export function arrowsOf(from: string, text: string): readonly Arrow[] {
  const addresses = text.matchAll(/\b(?:from|import)\s*\(?\s*"(\.{1,2}\/[^"?]+)/g);
  return [...addresses]
    .map(([, address]) => normalize(join(dirname(from), address)))
    .filter((to) => !to.startsWith(".."))
    .map((to) => ({ from, to: /\.\w+$/.test(to) ? to : `${to}.ts` }));
}

const roomOf = (path: string) => path.split("/")[0];

/** Those that lead from a layer to a higher one, or to a folder that is none. */
export function against(arrows: readonly Arrow[]): readonly Arrow[] {
  return arrows.filter(({ from, to }) => {
    const [here, there] = [LAYERS.indexOf(roomOf(from)), LAYERS.indexOf(roomOf(to))];
    return here === -1 || there === -1 || there > here;
  });
}

/** The files that can be reached from themselves, circle by circle. */
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

async function readArrows(src: string): Promise<readonly Arrow[]> {
  const names = await readdir(src, { recursive: true });
  const files = names.filter((name) => name.endsWith(".ts") && name.includes("/"));
  const texts = await Promise.all(files.map((name) => readFile(join(src, name), "utf8")));
  return files.flatMap((name, i) => arrowsOf(name, texts[i]));
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const arrows = await readArrows(fileURLToPath(new URL("../src", import.meta.url)));
  const wrong = against(arrows);
  const round = circles(arrows);
  const lines = [
    ...wrong.map(({ from, to }) => `src/${from}: imports ${to}, which lies in a higher layer`),
    ...round.map((files) => `src/${files[0]}: in a circle with ${files.slice(1).join(", ")}`),
    `${arrows.length} imports, ${wrong.length} against the layers, ${round.length} circles`,
  ];
  process.stdout.write(`${lines.join("\n")}\n`);
  if (wrong.length + round.length > 0) process.exitCode = 1;
}
