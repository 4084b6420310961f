/** A tile's name for people. Pure. */

/** `row 1, column 4` of a tile of the grid, counted from 1, with its layer in z if there are several; else its id. */
export function tileName(id: string): string {
  const found = /^r(\d+)_c(\d+)(?:_z(\d+))?$/.exec(id);
  if (found === null) return id;
  const [row, column, layer] = found.slice(1).map((index) => Number(index) + 1);
  return `row ${row}, column ${column}${found[3] === undefined ? "" : `, layer ${layer}`}`;
}

/** The same where there is no room for words. */
export function shortTileName(id: string): string {
  return tileName(id)
    .replace("row ", "")
    .replace(/, (column|layer) /g, "·");
}
