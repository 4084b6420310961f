/** Turns files and folders that a user drops or chooses into sources. */
import type { LocalSource } from "./open_source";

/** Returns the first file or folder of a drop; null: there is none. Must be called while the event is handled. */
export function droppedSource({ items, files }: DataTransfer): LocalSource | null {
  const entry = [...items]
    .map((item) => item.webkitGetAsEntry?.() ?? null)
    .find((one) => one !== null);
  if (entry?.isDirectory) return folderOf(entry as FileSystemDirectoryEntry);
  const [file] = files;
  return file === undefined ? null : { kind: "file", file };
}

function folderOf(folder: FileSystemDirectoryEntry): LocalSource {
  const find = (path: string) =>
    new Promise<File | null>((resolve, reject) => {
      const found = (entry: FileSystemEntry) =>
        (entry as FileSystemFileEntry).file(resolve, reject);
      folder.getFile(path, {}, found, () => resolve(null));
    });
  return { kind: "folder", name: folder.name, find };
}

/** Opens each further source that is dropped on the viewer, one at a time. */
export function acceptDrops(open: (source: LocalSource) => Promise<void>): void {
  let isBusy = false;
  addEventListener("dragover", (event) => event.preventDefault()); // otherwise the browser would open the file itself
  addEventListener("drop", (event) => {
    event.preventDefault();
    const source = event.dataTransfer && droppedSource(event.dataTransfer);
    if (source === null || isBusy) return;
    isBusy = true;
    void open(source).finally(() => {
      isBusy = false;
    });
  });
}

/** Returns the folder that a user has chosen, as a source; null: it has no files. */
export function chosenFolder(files: FileList): LocalSource | null {
  const [first] = files;
  if (first === undefined) return null;
  const [name] = first.webkitRelativePath.split("/");
  const byPath = new Map([...files].map((file) => [file.webkitRelativePath, file]));
  return { kind: "folder", name, find: async (path) => byPath.get(`${name}/${path}`) ?? null };
}
