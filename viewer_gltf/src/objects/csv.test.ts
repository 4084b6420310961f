import { expect, it } from "vitest";
import { objectsCsv } from "./csv";
import { loadedTable, sampleTable } from "./sample_table";

it("has a line for each object, with empty fields for missing values", async () => {
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

it("keeps a name that looks like a formula as text", async () => {
  expect(objectsCsv(await loadedTable(), [5])).toContain("105,'=1+1,4,");
});

it("requests the columns that have not loaded", () => {
  const table = sampleTable();
  expect(objectsCsv(table, [0])).toBeNull();
  expect(table.isLoading).toBe(true);
});
