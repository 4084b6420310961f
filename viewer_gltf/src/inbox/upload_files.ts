/** The files of one upload, sorted by name, as one stream of bytes that is sent in pieces. Pure. */

/** A file with its name in the upload, which contains its folders, separated by slashes. */
export type NamedFile = Readonly<{ name: string; file: Blob }>;

/** Files that operating systems leave in folders, and that are not parts of an image. */
const LEFT_BY_SYSTEM = /^(\.DS_Store|Thumbs\.db|desktop\.ini|\._.*)$/i;

function belongsToImage(name: string): boolean {
  const parts = name.split("/");
  return !LEFT_BY_SYSTEM.test(parts[parts.length - 1]) && !parts.includes("__MACOSX");
}

/** Largest number of files that are sampled for the mark, and the bytes that are read at each end of a file. */
const MARKED_FILES = 64;
const MARKED_BYTES = 4096;

export class UploadFiles {
  readonly files: readonly NamedFile[];
  /** Offset of each file in the stream, and the end of the last one. */
  private readonly starts: readonly number[];

  /** The order of `files` does not matter: browsers list a folder in any order. */
  constructor(files: Iterable<NamedFile>) {
    const kept = [...files].filter(({ name }) => belongsToImage(name));
    this.files = kept.sort((a, b) => (a.name < b.name ? -1 : 1));
    let at = 0;
    this.starts = [0, ...this.files.map(({ file }) => (at += file.size))];
  }

  get bytes(): number {
    return this.starts[this.files.length];
  }

  /** Names and sizes of the files, in the form that the server expects. */
  get list(): readonly (readonly [string, number])[] {
    return this.files.map(({ name, file }) => [name, file.size]);
  }

  /**
   * Returns a hash of samples of the bytes, hexadecimal. Files of two patients may have the same names and sizes, and
   * must not be confused when an upload continues.
   */
  async mark(): Promise<string> {
    const count = Math.min(MARKED_FILES, this.files.length);
    const samples = Array.from({ length: count }, (_, i) => {
      const { file } = this.files[Math.floor((i * this.files.length) / count)];
      return [file.slice(0, MARKED_BYTES), file.slice(Math.max(0, file.size - MARKED_BYTES))];
    });
    const bytes = await new Blob(samples.flat()).arrayBuffer();
    const digest = new Uint8Array(await crypto.subtle.digest("SHA-256", bytes));
    return [...digest].map((byte) => byte.toString(16).padStart(2, "0")).join("");
  }

  /**
   * Returns the files that contain the bytes from `start` up to, but not including, `end`. Empty files are never
   * returned.
   */
  filesIn(start: number, end: number): readonly NamedFile[] {
    return this.partsIn(start, end).map(({ index }) => this.files[index]);
  }

  /** Returns the bytes from `start` to `end` by reference, without reading them. */
  piece(start: number, end: number): Blob {
    const parts = this.partsIn(start, end).map(({ index, from, to }) => {
      const { file } = this.files[index];
      return from === 0 && to === file.size ? file : file.slice(from, to);
    });
    return new Blob(parts);
  }

  private partsIn(start: number, end: number) {
    const parts: { index: number; from: number; to: number }[] = [];
    for (let index = this.fileAt(start); index < this.files.length; index++) {
      const begin = this.starts[index];
      if (begin >= end) break;
      const from = Math.max(0, start - begin);
      const to = Math.min(this.starts[index + 1], end) - begin;
      if (to > from) parts.push({ index, from, to });
    }
    return parts;
  }

  /** Returns the last file that begins at or before a byte. Bisection is fast enough for 100 000 files of OME-Zarr. */
  private fileAt(byte: number): number {
    let [low, high] = [0, this.files.length];
    while (low + 1 < high) {
      const middle = (low + high) >> 1;
      if (this.starts[middle] <= byte) low = middle;
      else high = middle;
    }
    return low;
  }
}
