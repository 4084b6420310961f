import { describe, expect, it, vi } from "vitest";
import { BundleError } from "../bundle/errors";
import type { FilePart } from "../bundle/fetch";
import { loadedTable, sampleContent, sampleTable } from "./sample_table";
import { checkObjects, ObjectTable } from "./table";

describe("the table of objects", () => {
  it("finds the rows of a tile's objects, also if an object lies in two tiles", () => {
    const table = sampleTable();
    const [first, second] = [table.rowOf("r0_c0"), table.rowOf("r0_c1")];
    expect([0, 1].map(first)).toEqual([0, 1]);
    expect([0, 3, 4, 5].map(second)).toEqual([2, 5, 1, -1]);
    expect(table.rowOf("elsewhere")(0)).toBe(-1);
  });

  it("fetches a column when it is first read, and only once", async () => {
    const changed = vi.fn();
    const table = sampleTable(changed);
    expect(table.bytes("size")).toBeNull();
    expect(table.bytes("size")).toBeNull();
    expect(table.isLoading).toBe(true);
    await vi.waitFor(() => expect(changed).toHaveBeenCalledTimes(1));
    expect([...(table.bytes("size") ?? [])]).toEqual([0, 1, 64, 128, 200, 255]);
    expect(table.bytes("no such")).toBeNull();
    expect(table.isLoading).toBe(false);
  });

  it("fetches only a part for one value of a long column, but the whole file of a short one", async () => {
    const count = 5000;
    const values = Float32Array.from({ length: count }, (_, row) => row / 2);
    const content = { ...sampleContent(), count };
    const [size] = content.columns;
    const hashes = ["a", "b"].map((digit) => digit.repeat(64));
    content.columns = [{ ...size, exact: { ...size.exact, bytes: 4 * count }, parts: hashes }];
    const asked: (FilePart | undefined)[] = [];
    for (const knowsParts of [true, false]) {
      asked.length = 0;
      const table = new ObjectTable(
        content,
        Uint32Array.of(),
        new Float32Array(),
        null,
        async (_, part) => {
          asked.push(part);
          const { offset, length } = (knowsParts && part) || { offset: 0, length: 4 * count };
          return values.buffer.slice(offset, offset + length);
        },
        () => {},
        () => {},
      );
      for (const row of [4100, 4999]) {
        await vi.waitFor(() => expect(table.value("size", row)).toBe(row / 2));
      }
      expect(asked).toEqual([{ offset: 16384, length: 3616, sha256: hashes[1] }]);
      await vi.waitFor(() => expect(table.value("size", 3)).toBe(1.5));
      await vi.waitFor(() => expect(table.exact("size")?.length).toBe(count));
      expect(table.value("size", 4999)).toBe(2499.5);
      expect(asked.length).toBe(knowsParts ? 3 : 1);
    }
    const short = await loadedTable();
    expect(short.value("size", 3)).toBe(1e7);
    expect(short.value("no such", 3)).toBeNull();
  });

  it("reports a column that fails to load, and fetches it again on a retry", async () => {
    const failed = vi.fn();
    const ask = vi.fn(() => Promise.reject(new BundleError("gone")));
    const table = new ObjectTable(
      sampleContent(),
      Uint32Array.of(),
      new Float32Array(),
      null,
      ask,
      () => {},
      failed,
    );
    table.bytes("size");
    await vi.waitFor(() => expect(failed).toHaveBeenCalledTimes(1));
    table.bytes("size");
    expect(ask).toHaveBeenCalledTimes(1);
    table.retryFailed();
    table.bytes("size");
    expect(ask).toHaveBeenCalledTimes(2);
  });

  it("finds objects by number and by part of a name, matches at the beginning first", async () => {
    const table = await loadedTable();
    expect(table.find("KIDNEY", 5)).toEqual([2, 3]);
    expect(table.find("l", 2)).toEqual([0, 2]);
    expect(table.find("104", 5)).toEqual([4]);
    expect(table.find(" ", 5)).toEqual([]);
  });

  it("knows neighbours", () => {
    const table = sampleTable();
    expect([...table.neighbours(1)]).toEqual([0, 2]);
    expect([...table.neighbours(5)]).toEqual([]);
    expect([...(table.interfaces_um2(1) ?? [])]).toEqual([2, 30.5]);
  });
});

describe("objects.json", () => {
  it("is refused if a column or the boxes are too short, or if a tile names missing rows", () => {
    expect(checkObjects(sampleContent(), "o").count).toBe(6);
    const short = sampleContent();
    short.columns[0].exact.bytes -= 4;
    expect(() => checkObjects(short, "o")).toThrow("o: columns: size: expected 6 rows");
    const cut = sampleContent();
    cut.columns[1].parts = [];
    expect(() => checkObjects(cut, "o")).toThrow("o: columns: type: expected 6 rows");
    const boxes = { ...sampleContent().boxes, bytes: 24 };
    const few = { ...sampleContent(), boxes };
    expect(() => checkObjects(few, "o")).toThrow("o: boxes: expected 6 rows");
    for (const rows of [
      { first: 3, count: 4 },
      { first: 0, count: 1, more: [6] },
    ]) {
      const beyond = { ...sampleContent(), tiles: { r0_c0: rows } };
      expect(() => checkObjects(beyond, "o")).toThrow("o: tiles: r0_c0: a row beyond the 6");
    }
    expect(() => checkObjects({ ...sampleContent(), count: -1 }, "o")).toThrow(BundleError);
  });
});
