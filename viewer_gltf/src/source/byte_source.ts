/** Reads files of a source, whole or in part, from a host or from a file that was dropped on the page. */

/** A part of a file: bytes from an offset, or the last bytes. */
export type ByteRange =
  | Readonly<{ offset: number; length: number }>
  | Readonly<{ suffixLength: number }>;

/** One file. */
export interface ByteSource {
  /** The name for messages. */
  readonly name: string;
  size(): Promise<number>;
  read(offset: number, length: number): Promise<Uint8Array<ArrayBuffer>>;
  /** The whole file, piece by piece as it arrives. */
  stream(): Promise<ReadableStream<Uint8Array<ArrayBuffer>>>;
}

/** Files below a folder, as zarrita asks for them: a key begins with a slash. */
export interface FileStore {
  /** The reason why the host has not let the page read any file so far; null if it has. */
  readonly refusal?: Error | null;
  get(key: string): Promise<Uint8Array<ArrayBuffer> | undefined>;
  getRange(key: string, range: ByteRange): Promise<Uint8Array<ArrayBuffer> | undefined>;
}

/** A file of this machine. */
export class LocalFile implements ByteSource {
  constructor(private readonly file: File) {}

  get name(): string {
    return this.file.name;
  }

  async size(): Promise<number> {
    return this.file.size;
  }

  async read(offset: number, length: number): Promise<Uint8Array<ArrayBuffer>> {
    return new Uint8Array(await this.file.slice(offset, offset + length).arrayBuffer());
  }

  async stream(): Promise<ReadableStream<Uint8Array<ArrayBuffer>>> {
    return this.file.stream();
  }
}

/**
 * Returns the offset of the first byte, and the number of bytes, that a range covers in a file of
 * `size` bytes.
 */
export function placeOf(
  range: ByteRange,
  size: number,
): Readonly<{ offset: number; length: number }> {
  if ("offset" in range) return range;
  const length = Math.min(range.suffixLength, size);
  return { offset: size - length, length };
}

/** A folder of this machine. Each file is looked up only when it is read, since there may be a million. */
export class LocalFolder implements FileStore {
  /** @param find the file at a path below the folder; null: there is none */
  constructor(private readonly find: (path: string) => Promise<File | null>) {}

  async get(key: string): Promise<Uint8Array<ArrayBuffer> | undefined> {
    const file = await this.find(key.slice(1));
    return file === null ? undefined : new Uint8Array(await file.arrayBuffer());
  }

  async getRange(key: string, range: ByteRange): Promise<Uint8Array<ArrayBuffer> | undefined> {
    const file = await this.find(key.slice(1));
    if (file === null) return undefined;
    const { offset, length } = placeOf(range, file.size);
    return new LocalFile(file).read(offset, length);
  }
}
