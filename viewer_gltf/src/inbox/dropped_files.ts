/** The files that a user drops or chooses, with their paths in the dropped folder. */
import type { NamedFile } from "./upload_files";

/** Called with the number of files that were found so far. */
type OnFound = (count: number) => void;

/** Largest number of files that are requested at a time; a folder may have thousands, and each answer takes a moment. */
const AT_A_TIME = 64;

/** Dropped files, and handles by which a later visit reads them again. Some browsers have no handles. */
export type Dropped = Readonly<{
  handles: Promise<readonly FileSystemHandle[]>;
  files: (onFound: OnFound) => Promise<readonly NamedFile[]>;
}>;

type WithHandle = Readonly<{ getAsFileSystemHandle?: () => Promise<FileSystemHandle | null> }>;

/** Returns the dropped files. Must be called within the event, because its items are gone afterwards. */
export function droppedFiles({ items, files }: DataTransfer): Dropped {
  const ofFiles = [...items].filter(({ kind }) => kind === "file");
  const entries = ofFiles.map((item) => item.webkitGetAsEntry?.() ?? null);
  const asked = ofFiles.map((item) => (item as WithHandle).getAsFileSystemHandle?.() ?? null);
  const handles = Promise.all(asked).then(
    (found) => (found.every((each) => each !== null) ? (found as FileSystemHandle[]) : []),
    () => [],
  );
  const plain = [...files].map((file) => ({ name: file.name, file }));
  return {
    handles,
    files: async (onFound) => {
      const known = await handles;
      if (known.length > 0) return filesOfHandles(known, onFound);
      const found = entries.filter((entry) => entry !== null);
      return found.length > 0 ? filesOfEntries(found, onFound) : plain;
    },
  };
}

/** Returns the files of an input with their paths in the chosen folder. */
export function chosenFiles(files: Iterable<File>): readonly NamedFile[] {
  return [...files].map((file) => ({ name: file.webkitRelativePath || file.name, file }));
}

/** Returns all files in these files and folders. Rejects if one can't be read. */
export async function filesOfHandles(
  handles: readonly FileSystemHandle[],
  onFound: OnFound,
): Promise<readonly NamedFile[]> {
  const found = new Finder(onFound);
  const walk = async (handle: FileSystemHandle, folder: string): Promise<void> => {
    const name = `${folder}${handle.name}`;
    if (handle.kind === "file") {
      await found.add(name, () => (handle as FileSystemFileHandle).getFile());
      return;
    }
    const inside = handle as FileSystemDirectoryHandle & {
      values(): AsyncIterable<FileSystemHandle>;
    };
    for await (const each of inside.values()) await walk(each, `${name}/`);
  };
  for (const handle of handles) await walk(handle, "");
  return found.all();
}

async function filesOfEntries(
  entries: readonly FileSystemEntry[],
  onFound: OnFound,
): Promise<readonly NamedFile[]> {
  const found = new Finder(onFound);
  const walk = async (entry: FileSystemEntry, folder: string): Promise<void> => {
    const name = `${folder}${entry.name}`;
    if (entry.isFile) {
      const { file } = promised(entry as FileSystemFileEntry);
      await found.add(name, file);
      return;
    }
    const reader = (entry as FileSystemDirectoryEntry).createReader();
    // a reader gives at most a hundred entries at once, and none at the end
    for (let more = await readSome(reader); more.length > 0; more = await readSome(reader)) {
      for (const each of more) await walk(each, `${name}/`);
    }
  };
  for (const entry of entries) await walk(entry, "");
  return found.all();
}

const promised = (entry: FileSystemFileEntry) => ({
  file: () => new Promise<File>((resolve, reject) => entry.file(resolve, reject)),
});

const readSome = (reader: FileSystemDirectoryReader) =>
  new Promise<FileSystemEntry[]>((resolve, reject) => reader.readEntries(resolve, reject));

/** Requests files, several at a time, and collects them. */
class Finder {
  private readonly found: NamedFile[] = [];
  private readonly pending = new Set<Promise<void>>();

  constructor(private readonly onFound: OnFound) {}

  async add(name: string, ask: () => Promise<File>): Promise<void> {
    const asked: Promise<void> = ask().then((file) => {
      this.found.push({ name, file });
      this.onFound(this.found.length);
      this.pending.delete(asked);
    });
    this.pending.add(asked);
    if (this.pending.size >= AT_A_TIME) await Promise.race(this.pending);
  }

  async all(): Promise<readonly NamedFile[]> {
    await Promise.all(this.pending);
    return this.found;
  }
}
