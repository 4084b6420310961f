/**
 * Reads the files of a zip archive part by part: OME-Zarr in one file (`.ozx` of RFC-9, `.zarr.zip`). Members are stored
 * or deflated. The group lies at the root of the archive, or in its only folder.
 *
 * References: PKWARE APPNOTE 6.3; https://ngff.openmicroscopy.org/rfc/9
 */
import { type ByteRange, type ByteSource, type FileStore, placeOf } from "./byte_source";
import { SourceError } from "./source_error";

const END = 0x06054b50;
const END_64_LOCATOR = 0x07064b50;
const END_64 = 0x06064b50;
const ENTRY = 0x02014b50;
const LOCAL = 0x04034b50;
/** Bytes of the end record, of the locator before it, and of the longest comment after it. */
const [END_BYTES, LOCATOR_BYTES, COMMENT_BYTES] = [22, 20, 0xffff];
const ENTRY_BYTES = 46;
const LOCAL_BYTES = 30;
/** Identifier of the extra field that holds 64-bit numbers. */
const EXTRA_64 = 1;
/** Placeholder for a number that only the extra field holds. */
const WIDE = 0xffffffff;
/** Largest list of members that is read, bytes; enough for about a million members. */
const MAX_LIST_BYTES = 1 << 27;
/** Largest member that is unpacked, bytes. */
const MAX_UNPACKED_BYTES = 1 << 29;
/** Numbers of the compression methods of members: stored (not compressed), and deflate. */
const [STORED, DEFLATED] = [0, 8];

type Member = Readonly<{
  method: number;
  packed: number;
  unpacked: number;
  /** Offset of the member's local header in the archive, bytes. */
  header: number;
  /** Estimated size of the local header, bytes; its extra fields may differ from those in the list. */
  headerBytes: number;
}>;

export class ZipStore implements FileStore {
  /** Offset of the contents of each member that was read in part. */
  private readonly starts = new Map<string, number>();

  private constructor(
    private readonly archive: ByteSource,
    private readonly members: ReadonlyMap<string, Member>,
    private readonly root: string,
  ) {}

  /** Opens an archive. Throws SourceError if it is not a zip archive with a Zarr group. */
  static async open(archive: ByteSource): Promise<ZipStore> {
    const { offset, bytes, count } = await readList(archive);
    const members = parseList(bytes, count, archive.name, offset);
    const root = rootOf([...members.keys()]);
    if (root === null) {
      throw new SourceError(
        `${archive.name}: found a zip archive without a Zarr group, expected OME-Zarr: open other formats, such as ` +
          "DICOM, with stereocell view",
      );
    }
    return new ZipStore(archive, members, root);
  }

  async get(key: string): Promise<Uint8Array<ArrayBuffer> | undefined> {
    const name = this.root + key.slice(1);
    const member = this.members.get(name);
    if (member === undefined) return undefined;
    const { header, headerBytes, packed } = member;
    const room = Math.min(headerBytes + packed, (await this.archive.size()) - header);
    const bytes = await this.archive.read(header, room);
    const start = this.startIn(bytes, name);
    const content =
      start + packed <= bytes.length
        ? bytes.slice(start, start + packed)
        : await this.archive.read(header + start, packed);
    return this.unpack(content, member, name);
  }

  async getRange(key: string, range: ByteRange): Promise<Uint8Array<ArrayBuffer> | undefined> {
    const name = this.root + key.slice(1);
    const member = this.members.get(name);
    if (member === undefined) return undefined;
    const { offset, length } = placeOf(range, member.unpacked);
    if (member.method !== STORED) return (await this.get(key))?.slice(offset, offset + length);
    let start = this.starts.get(name);
    if (start === undefined) {
      const head = await this.archive.read(member.header, LOCAL_BYTES);
      start = member.header + this.startIn(head, name);
      this.starts.set(name, start);
    }
    if (offset + length > member.unpacked) {
      throw new SourceError(
        `${this.archive.name}: ${name}: found a shard whose index points beyond its end: make the file again.`,
      );
    }
    return this.archive.read(start + offset, length);
  }

  /** Returns the offset of the contents, counted from the local header at the start of the bytes. */
  private startIn(bytes: Uint8Array, name: string): number {
    const view = viewOf(bytes);
    if (bytes.length < LOCAL_BYTES || view.getUint32(0, true) !== LOCAL) {
      throw new SourceError(
        `${this.archive.name}: found no member at the listed place of ${name}: make the file again.`,
      );
    }
    return LOCAL_BYTES + view.getUint16(26, true) + view.getUint16(28, true);
  }

  private async unpack(
    content: Uint8Array<ArrayBuffer>,
    { method, unpacked }: Member,
    name: string,
  ): Promise<Uint8Array<ArrayBuffer>> {
    if (method === STORED) return content;
    if (method !== DEFLATED) {
      throw new SourceError(
        `${this.archive.name}: ${name} is packed by method ${method}, expected 0 (stored) or 8 (deflate): make the file again.`,
      );
    }
    const damaged = `${this.archive.name}: ${name} is damaged: make the file again.`;
    if (unpacked > MAX_UNPACKED_BYTES) throw new SourceError(damaged);
    const made = new Uint8Array(unpacked);
    let at = 0;
    try {
      const stream = new Blob([content])
        .stream()
        .pipeThrough(new DecompressionStream("deflate-raw"));
      for await (const part of partsOf(stream)) {
        made.set(part, at); // throws if the member is longer than listed
        at += part.length;
      }
    } catch (error) {
      throw new SourceError(damaged, { cause: error });
    }
    if (at !== unpacked) throw new SourceError(damaged);
    return made;
  }
}

/** Yields the parts of a stream; Safari's streams can't be iterated. */
export async function* partsOf(
  stream: ReadableStream<Uint8Array<ArrayBuffer>>,
): AsyncGenerator<Uint8Array<ArrayBuffer>> {
  const reader = stream.getReader();
  try {
    for (;;) {
      const { done, value } = await reader.read();
      if (done) return;
      yield value;
    }
  } finally {
    await reader.cancel().catch(() => undefined); // a stream that has failed can't be cancelled, and its error was thrown already
  }
}

const viewOf = (bytes: Uint8Array) =>
  new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);

/** Reads the list of members at the end of the archive. */
async function readList(archive: ByteSource) {
  const wrong = new SourceError(
    `${archive.name}: found no complete zip archive, expected an OME-Zarr image in one file.`,
  );
  const size = await archive.size();
  const tailBytes = Math.min(size, END_BYTES + LOCATOR_BYTES + COMMENT_BYTES);
  const tail = await archive.read(size - tailBytes, tailBytes);
  const view = viewOf(tail);
  let end = tail.length - END_BYTES;
  while (end >= 0 && view.getUint32(end, true) !== END) end--;
  if (end < 0) throw wrong;
  let count = view.getUint16(end + 10, true);
  let bytes = view.getUint32(end + 12, true);
  let offset = view.getUint32(end + 16, true);
  const locator = end - LOCATOR_BYTES;
  if (locator >= 0 && view.getUint32(locator, true) === END_64_LOCATOR) {
    const at = Number(view.getBigUint64(locator + 8, true));
    const record = viewOf(await archive.read(at, 56));
    if (record.getUint32(0, true) !== END_64) throw wrong;
    count = Number(record.getBigUint64(32, true));
    bytes = Number(record.getBigUint64(40, true));
    offset = Number(record.getBigUint64(48, true));
  }
  if (bytes > MAX_LIST_BYTES) {
    throw new SourceError(
      `${archive.name}: found ${count} members, more than a page can list: make the file again with shards.`,
    );
  }
  if (offset + bytes > size) throw wrong;
  const inTail = offset - (size - tailBytes);
  const list = inTail >= 0 ? tail.slice(inTail, inTail + bytes) : await archive.read(offset, bytes);
  return { offset, bytes: list, count };
}

function parseList(
  bytes: Uint8Array,
  count: number,
  where: string,
  end: number,
): ReadonlyMap<string, Member> {
  const view = viewOf(bytes);
  const members = new Map<string, Member>();
  const decoder = new TextDecoder();
  for (let at = 0, i = 0; i < count; i++) {
    if (at + ENTRY_BYTES > bytes.length || view.getUint32(at, true) !== ENTRY) {
      throw new SourceError(`${where}: found a damaged list of members: make the file again.`);
    }
    const flags = view.getUint16(at + 8, true);
    const [nameBytes, extraBytes, commentBytes] = [28, 30, 32].map((field) =>
      view.getUint16(at + field, true),
    );
    const name = decoder.decode(bytes.subarray(at + ENTRY_BYTES, at + ENTRY_BYTES + nameBytes));
    if ((flags & 1) === 1) {
      throw new SourceError(
        `${where}: ${name} has a password, expected none: make the file again without it.`,
      );
    }
    let [packed, unpacked] = [view.getUint32(at + 20, true), view.getUint32(at + 24, true)];
    let header = view.getUint32(at + 42, true);
    let extra = at + ENTRY_BYTES + nameBytes;
    const after = extra + extraBytes;
    while (extra + 4 <= after && after <= bytes.length) {
      const length = view.getUint16(extra + 2, true);
      if (view.getUint16(extra, true) === EXTRA_64) {
        let field = extra + 4;
        const next = () => {
          const value =
            field + 8 <= extra + 4 + length ? Number(view.getBigUint64(field, true)) : 0;
          field += 8;
          return value;
        };
        if (unpacked === WIDE) unpacked = next();
        if (packed === WIDE) packed = next();
        if (header === WIDE) header = next();
      }
      extra += 4 + length;
    }
    if (header + LOCAL_BYTES + packed > end || after + commentBytes > bytes.length) {
      throw new SourceError(`${where}: found a damaged list of members: make the file again.`);
    }
    if (!name.endsWith("/")) {
      const method = view.getUint16(at + 10, true);
      const headerBytes = LOCAL_BYTES + nameBytes + extraBytes;
      members.set(name, { method, packed, unpacked, header, headerBytes });
    }
    at = after + commentBytes;
  }
  return members;
}

/** Returns the folder of the group in the archive, empty or with a closing slash; null if there is none. */
function rootOf(names: readonly string[]): string | null {
  const isGroup = (root: string) =>
    ["zarr.json", ".zattrs", ".zgroup"].some((name) => names.includes(root + name));
  if (isGroup("")) return "";
  const folders = new Set(names.map((name) => name.split("/", 1)[0]));
  const [only] = folders;
  return folders.size === 1 && isGroup(`${only}/`) ? `${only}/` : null;
}
