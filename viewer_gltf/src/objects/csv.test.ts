import { expect, it } from "vitest";
import { objectsCsv } from "./csv";
import { loadedTable, sampleTable } from "./sample_table";

it("objects are a table with a line each, what is missing empty", async () => {
  expect(objectsCsv(await loadedTable(), [0, 3, 1])).toBe(
    [
      "label,name,size (um3),type",
      '100,liver,,"soft, tissue"',
      "103,right kidney,10000000,",
      "101,spleen,10,vessel",
      "",
    ].join("\r\n"),
  );
});

it("no field is a formula", async () => {
  expect(objectsCsv(await loadedTable(), [5])).toContain("105,'=1+1,4,");
});

it("columns that have not come are asked for", () => {
  const table = sampleTable();
  expect(objectsCsv(table, [0])).toBeNull();
  expect(table.isLoading).toBe(true);
});
