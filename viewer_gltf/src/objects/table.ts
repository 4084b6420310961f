/** The table of a label map's objects. Its columns are fetched when they are first read. */

import objectsSchema from "../../../schemas/objects.schema.json";
import { BundleError } from "../bundle/errors";
import { type FilePart, fetchFile, fetchPart, parseJson } from "../bundle/fetch";
import type { FileRef } from "../bundle/generated/bundle";
import type { ChannelObjects, ObjectColumn } from "../bundle/generated/objects";
import { checkSchema } from "../bundle/schema_check";

/** Number of rows in one separately checked part of a column's exact values. */
const PART_ROWS = 4096;

/** Checks the content of objects.json against its schema and against its own counts. Throws BundleError. */
export function checkObjects(value: unknown, path: string): ChannelObjects {
  checkSchema(objectsSchema, value, path);
  const { count, boxes, columns, tiles } = value as ChannelObjects;
  if (boxes.bytes !== 24 * count) throw new BundleError(`${path}: boxes: expected ${count} rows`);
  for (const { id, bytes, exact, parts } of columns) {
    const isCut = parts === undefined || parts.length === Math.ceil(count / PART_ROWS);
    if (bytes.bytes !== count || exact.bytes !== 4 * count || !isCut) {
      throw new BundleError(`${path}: columns: ${id}: expected ${count} rows`);
    }
  }
  for (const [tile, { first, count: of, more = [] }] of Object.entries(tiles)) {
    if (first + of > count || more.some((row) => row >= count)) {
      throw new BundleError(`${path}: tiles: ${tile}: a row beyond the ${count} that there are`);
    }
  }
  return value as ChannelObjects;
}

/** Loads objects.json and the files that are always needed: labels, boxes and neighbours. Throws BundleError. */
export async function loadObjects(
  base: string,
  file: FileRef,
  onChange: () => void,
  onError: (error: unknown) => void,
): Promise<ObjectTable> {
  const text = new TextDecoder().decode(await fetchFile(base, file));
  const content = checkObjects(parseJson(text, file.path), file.path);
  const { labels, boxes, neighbours } = content;
  const { first, rows, area_um2 } = neighbours ?? {};
  const [ofLabels, ofBoxes, ofFirst, ofRows, ofAreas] = await Promise.all(
    [labels, boxes, first, rows, area_um2].map(
      async (ref) => ref && (await fetchFile(base, ref)).buffer,
    ),
  );
  if (ofLabels === undefined || ofBoxes === undefined) throw new TypeError("needs labels, boxes");
  const next = ofFirst &&
    ofRows && {
      first: new Uint32Array(ofFirst),
      rows: new Uint32Array(ofRows),
      area_um2: ofAreas === undefined ? null : new Float32Array(ofAreas),
    };
  const fetchOne = async (ref: FileRef, part?: FilePart) =>
    part === undefined
      ? (await fetchFile(base, ref)).buffer
      : (await fetchPart(base, ref, part, "rows")).bytes.buffer;
  return new ObjectTable(
    content,
    content.label_bytes === 8 ? new BigUint64Array(ofLabels) : new Uint32Array(ofLabels),
    new Float32Array(ofBoxes),
    next ?? null,
    fetchOne,
    onChange,
    onError,
  );
}

/** The neighbours of each row: row i has rows[first[i]] to rows[first[i + 1] - 1]. */
type Neighbours = Readonly<{
  first: Uint32Array;
  rows: Uint32Array;
  /** Area of the interface to each neighbour, um^2; null: not known. */
  area_um2: Float32Array | null;
}>;

export class ObjectTable {
  private readonly byId: ReadonlyMap<string, ObjectColumn>;
  private readonly files = new Map<string, ArrayBuffer>();
  private readonly asked = new Set<string>();

  /** @param fetchOne fetches a file of the table, or a part of it; for a part it may also return the whole file */
  constructor(
    private readonly content: ChannelObjects,
    private readonly labels: Uint32Array | BigUint64Array,
    /** Six values for each row, in um: the smallest x, y, z and the largest. */
    readonly boxes: Float32Array,
    private readonly next: Neighbours | null,
    private readonly fetchOne: (file: FileRef, part?: FilePart) => Promise<ArrayBuffer>,
    private readonly onChange: () => void,
    private readonly onError: (error: unknown) => void,
  ) {
    this.byId = new Map(content.columns.map((column) => [column.id, column]));
  }

  get count(): number {
    return this.content.count;
  }

  get columns(): readonly ObjectColumn[] {
    return this.content.columns;
  }

  /** ID of the column that colours the objects at the start; "": no column does. */
  get first(): string {
    return this.byId.has(this.content.default) ? this.content.default : "";
  }

  /** Name of the object of each row; empty if the label map has no names. */
  get names(): readonly string[] {
    return this.content.names;
  }

  /** ID of the channel that is painted on the objects; "": none is. */
  get painter(): string {
    return this.content.paint ?? "";
  }

  get hasNeighbours(): boolean {
    return this.next !== null;
  }

  get isLoading(): boolean {
    return this.asked.size > 0;
  }

  column(id: string): ObjectColumn | null {
    return this.byId.get(id) ?? null;
  }

  label(row: number): string {
    return String(this.labels[row]);
  }

  /** Name of the object, or its number in the label map if it has no name. */
  title(row: number): string {
    return this.content.names[row] || this.label(row);
  }

  neighbours(row: number): Uint32Array {
    if (this.next === null) return new Uint32Array();
    const { first, rows } = this.next;
    return rows.subarray(first[row], first[row + 1]);
  }

  /** Areas of the interfaces to the neighbours of a row, um^2; null: not known. */
  interfaces_um2(row: number): Float32Array | null {
    if (!this.next?.area_um2) return null;
    const { first, area_um2 } = this.next;
    return area_um2.subarray(first[row], first[row + 1]);
  }

  /** Returns a function from a tile's feature ID to the row; -1: the table has no row for it. */
  rowOf(tile: string): (feature: number) => number {
    const { first, count, more = [] } = this.content.tiles[tile] ?? { first: 0, count: 0 };
    return (feature) => (feature < count ? first + feature : (more[feature - count] ?? -1));
  }

  /** One byte for each row; null: still loading. */
  bytes(id: string): Uint8Array | null {
    const file = this.file(this.byId.get(id)?.bytes);
    return file && new Uint8Array(file);
  }

  /** The exact value for each row; null: still loading. */
  exact(id: string): Float32Array | null {
    const file = this.file(this.byId.get(id)?.exact);
    return file && new Float32Array(file);
  }

  /** One exact value; null: still loading. Only the part of the column that contains it is fetched. */
  value(id: string, row: number): number | null {
    const column = this.byId.get(id);
    const sha256 = column?.parts?.[Math.floor(row / PART_ROWS)];
    if (column === undefined || sha256 === undefined || this.files.has(column.exact.path)) {
      return this.exact(id)?.[row] ?? null;
    }
    const first = row - (row % PART_ROWS);
    const length = 4 * Math.min(PART_ROWS, this.count - first);
    const part = this.file(column.exact, { offset: 4 * first, length, sha256 });
    return part && new Float32Array(part)[row - first];
  }

  /** Returns rows whose name contains the text, or whose number begins with it. Names that begin with it come first. */
  find(words: string, most: number): readonly number[] {
    const wanted = words.trim().toLowerCase();
    if (wanted === "") return [];
    const starting: number[] = [];
    const within: number[] = [];
    for (let row = 0; row < this.count && starting.length < most; row++) {
      const texts = [this.title(row).toLowerCase(), this.label(row)];
      if (texts.some((text) => text.startsWith(wanted))) starting.push(row);
      else if (within.length < most && texts[0].includes(wanted)) within.push(row);
    }
    return [...starting, ...within].slice(0, most);
  }

  private file(ref: FileRef | undefined, part?: FilePart): ArrayBuffer | null {
    if (ref === undefined) return null;
    const key = part === undefined ? ref.path : `${ref.path} ${part.offset}`;
    const found = this.files.get(key);
    if (found !== undefined) return found;
    if (this.asked.has(key) || this.failed.has(key)) return null;
    this.asked.add(key);
    this.fetchOne(ref, part)
      .then(
        // a host without support for range requests sends the whole file
        (bytes) => this.files.set(bytes.byteLength === ref.bytes ? ref.path : key, bytes),
        (error) => {
          this.failed.add(key);
          this.onError(error);
        },
      )
      .finally(() => {
        this.asked.delete(key);
        this.onChange();
      });
    return null;
  }

  private readonly failed = new Set<string>();

  retryFailed(): void {
    this.failed.clear();
  }
}
