import { expect, it } from "vitest";
import { sampleTable } from "./sample_table";
import { largestWall } from "./section";

it("a card names the neighbour with the largest wall, where one is known", () => {
  const table = sampleTable();
  const title = (row: number) => table.title(row);
  expect(largestWall(table, 1)).toBe("left kidney, 30.5 µm²");
  expect(largestWall(table, 5)).toBe("");
  const without = { neighbours: () => Uint32Array.of(1), walls_um2: () => null, title };
  expect(largestWall(without, 0)).toBe("");
});
