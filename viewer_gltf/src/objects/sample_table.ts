/** A table of a few rows, for tests. */
import type { FileRef } from "../bundle/generated/bundle";
import type { ChannelObjects } from "../bundle/generated/objects";
import { ObjectTable } from "./table";

export const COUNT = 6;
const BYTES: Readonly<Record<string, readonly number[]>> = {
  size: [0, 1, 64, 128, 200, 255],
  type: [1, 2, 1, 0, 2, 1],
};
const EXACT: Readonly<Record<string, readonly number[]>> = {
  size: [Number.NaN, 10, 20.5, 1e7, 3, 4],
  type: [0, 1, 0, -1, 1, 0],
};

export function sampleContent(): ChannelObjects {
  const ref = (path: string, bytes: number): FileRef => ({ path, bytes, sha256: "0".repeat(64) });
  const files = (id: string) => ({
    bytes: ref(`${id}.u8`, COUNT),
    exact: ref(`${id}.f32`, 4 * COUNT),
  });
  return {
    count: COUNT,
    labels: ref("labels", 4 * COUNT),
    label_bytes: 4,
    names: ["liver", "spleen", "left kidney", "right kidney", "aorta", "=1+1"],
    boxes: ref("boxes", 24 * COUNT),
    default: "type",
    tiles: { r0_c0: { first: 0, count: 2 }, r0_c1: { first: 2, count: 4, more: [1] } },
    columns: [
      {
        id: "size",
        name: "Size",
        about: "",
        unit: "um3",
        kind: "number",
        known: 5,
        ...files("size"),
        range: { min: 1, max: 1000, low: 1, high: 100, scale: "log" },
      },
      {
        id: "type",
        name: "Type",
        about: "",
        unit: "",
        kind: "category",
        known: 5,
        ...files("type"),
        categories: ["soft, tissue", "vessel"],
        colors: [
          [1, 0, 0],
          [0, 0, 1],
        ],
      },
    ],
  };
}

/** @param changed called whenever a file has loaded */
export function sampleTable(changed = () => {}, failed = (_: unknown) => {}): ObjectTable {
  const fetchOne = async ({ path }: FileRef) => {
    const [id, kind] = path.split(".");
    return kind === "u8" ? Uint8Array.from(BYTES[id]).buffer : Float32Array.from(EXACT[id]).buffer;
  };
  const boxes = Float32Array.from(
    { length: 6 * COUNT },
    (_, i) => 10 * Math.floor(i / 6) + (i % 6 > 2 ? 5 : 0),
  );
  const labels = Uint32Array.from({ length: COUNT }, (_, i) => 100 + i);
  const next = {
    first: Uint32Array.of(0, 1, 3, 4, 4, 4, 4),
    rows: Uint32Array.of(1, 0, 2, 1),
    area_um2: Float32Array.of(2, 2, 30.5, 30.5),
  };
  return new ObjectTable(sampleContent(), labels, boxes, next, fetchOne, changed, failed);
}

/** Returns the sample table after all its files have loaded. */
export async function loadedTable(): Promise<ObjectTable> {
  const table = sampleTable();
  for (const { id } of table.columns) {
    table.bytes(id);
    table.exact(id);
  }
  while (table.isLoading) await new Promise((resolve) => setTimeout(resolve));
  return table;
}
