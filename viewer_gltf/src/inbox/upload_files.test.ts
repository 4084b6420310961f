import { describe, expect, it } from "vitest";
import { UploadFiles } from "./upload_files";

const bytesOf = (...values: number[]) => new Blob([new Uint8Array(values)]);
const read = async (blob: Blob) => [...new Uint8Array(await blob.arrayBuffer())];

/** A folder like that of an OME-Zarr: an empty file, two short files, and a longer one. */
const FILES = [
  { name: "a.zarr/1/0", file: bytesOf(5, 6, 7, 8, 9, 10, 11) },
  { name: "a.zarr/.zattrs", file: bytesOf(1, 2) },
  { name: "a.zarr/0/0", file: bytesOf() },
  { name: "a.zarr/0/1", file: bytesOf(3, 4) },
];
const STREAM = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11];

describe("the files of an upload", () => {
  it("are one stream in the order of their names, in whichever order they were found", () => {
    const list = [
      ["a.zarr/.zattrs", 2],
      ["a.zarr/0/0", 0],
      ["a.zarr/0/1", 2],
      ["a.zarr/1/0", 7],
    ];
    expect(new UploadFiles(FILES).list).toEqual(list);
    expect(new UploadFiles(FILES.toReversed()).list).toEqual(list);
  });

  it("leave out files that operating systems add to folders, but not OME-Zarr's files with a dot", () => {
    const names = ["x/.DS_Store", "x/Thumbs.db", "x/._a.tif", "__MACOSX/x/a.tif", "x/desktop.ini"];
    const left = [...names, "x/.zgroup", "x/a.tif"].map((name) => ({ name, file: bytesOf(1) }));
    expect(new UploadFiles(left).list.map(([name]) => name)).toEqual(["x/.zgroup", "x/a.tif"]);
  });

  it("are read in pieces between any two bytes of the stream, also across files", async () => {
    const files = new UploadFiles(FILES);
    expect(files.bytes).toBe(STREAM.length);
    for (let start = 0; start <= STREAM.length; start++) {
      for (let end = start; end <= STREAM.length; end++) {
        expect(await read(files.piece(start, end)), `${start} to ${end}`).toEqual(
          STREAM.slice(start, end),
        );
      }
    }
  });

  it("have a fingerprint that differs if bytes differ, even with the same names and sizes", async () => {
    const mark = (...values: number[]) =>
      new UploadFiles([
        { name: "01.dcm", file: bytesOf(...values) },
        { name: "02.dcm", file: bytesOf(9) },
      ]).mark();
    expect(await mark(1, 2)).toMatch(/^[0-9a-f]{64}$/);
    expect(await mark(1, 2)).toBe(await mark(1, 2));
    expect(await mark(1, 2)).not.toBe(await mark(1, 3));
    const long = (last: number) => {
      const bytes = new Uint8Array(100_000);
      bytes[bytes.length - 1] = last;
      return new UploadFiles([{ name: "a.nii", file: new Blob([bytes]) }]).mark();
    };
    expect(await long(1)).not.toBe(await long(2));
  });

  it("are found by name for each piece of the stream", () => {
    const files = new UploadFiles(FILES);
    const namesIn = (start: number, end: number) =>
      files.filesIn(start, end).map(({ name }) => name.slice("a.zarr/".length));
    expect(namesIn(0, 2)).toEqual([".zattrs"]);
    expect(namesIn(1, 5)).toEqual([".zattrs", "0/1", "1/0"]);
    expect(namesIn(6, 11)).toEqual(["1/0"]);
  });

  it("are not read before they are sent: a piece refers to few of many files", () => {
    let reads = 0;
    const many = Array.from({ length: 1000 }, (_, i) => {
      const file = new Blob([new Uint8Array(1000)]);
      file.arrayBuffer = () => {
        reads++;
        return Promise.reject(new Error("read whole"));
      };
      return { name: `folder/${String(i).padStart(4, "0")}.dcm`, file };
    });
    const files = new UploadFiles(many);
    expect(files.piece(499_500, 600_500).size).toBe(101_000);
    expect(files.filesIn(499_500, 600_500)).toHaveLength(102);
    expect(reads).toBe(0);
  });
});
