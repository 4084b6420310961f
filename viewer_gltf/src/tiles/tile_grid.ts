/** Tiles by row and column, if their ids have them: r<row>_c<column>. Row 0 is at the top. Pure. */

type Cell = Readonly<{ id: string; row: number; column: number }>;
export type Grid = Readonly<{ rows: number; columns: number; cells: readonly Cell[] }>;

/** Largest number of cells of a map; more would be too small to tap. */
const MAX_CELLS = 400;

/** Returns null if the ids have another form (or several layers), or if the map would be too large. */
export function tileGrid(ids: readonly string[]): Grid | null {
  const cells: Cell[] = [];
  for (const id of ids) {
    const found = /^r(\d{1,4})_c(\d{1,4})$/.exec(id);
    if (found === null) return null;
    cells.push({ id, row: Number(found[1]), column: Number(found[2]) });
  }
  const lowest = (values: number[]) => values.reduce((a, b) => Math.min(a, b), Infinity);
  const highest = (values: number[]) => values.reduce((a, b) => Math.max(a, b), -Infinity);
  const rows = cells.map(({ row }) => row);
  const columns = cells.map(({ column }) => column);
  const [top, left] = [lowest(rows), lowest(columns)];
  const grid = { rows: highest(rows) - top + 1, columns: highest(columns) - left + 1 };
  if (!(grid.rows * grid.columns <= MAX_CELLS)) return null;
  if (new Set(cells.map(({ row, column }) => `${row} ${column}`)).size < cells.length) return null;
  return {
    ...grid,
    cells: cells.map(({ id, row, column }) => ({ id, row: row - top, column: column - left })),
  };
}
