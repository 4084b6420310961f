import { expect, it } from "vitest";
import { sampleTable } from "./sample_table";
import { largestInterface } from "./section";

it("a card names the neighbour with the largest interface if the areas are known", () => {
  const table = sampleTable();
  const title = (row: number) => table.title(row);
  expect(largestInterface(table, 1)).toBe("left kidney, 30.5 µm²");
  expect(largestInterface(table, 5)).toBe("");
  const without = { neighbours: () => Uint32Array.of(1), interfaces_um2: () => null, title };
  expect(largestInterface(without, 0)).toBe("");
});
