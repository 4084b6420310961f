/** Tiles by row and column, where their ids hold them: r<row>_c<column>. Row 0 is on top. Pure. */

type Cell = Readonly<{ id: string; row: number; column: number }>;
export type Grid = Readonly<{ rows: number; columns: number; cells: readonly Cell[] }>;

/** Most cells of a map: the user could not tap on more. */
const MAX_CELLS = 400;

/** null: the ids are of another kind (or of several layers), or the map would be too large. */
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
