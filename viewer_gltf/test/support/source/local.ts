/** Sources of a folder on disk, as a user drops them on the page. */
import { readFile, stat } from "node:fs/promises";
import { basename, join } from "node:path";
import type { LocalSource } from "../../../src/source/open_source";

/** Returns the file or folder at a path. */
export async function localSource(path: string): Promise<LocalSource> {
  const name = basename(path);
  if (!(await stat(path)).isDirectory()) {
    return { kind: "file", file: new File([await readFile(path)], name) };
  }
  const find = (below: string) =>
    readFile(join(path, below)).then(
      (bytes) => new File([bytes], basename(below)),
      () => null,
    );
  return { kind: "folder", name, find };
}
