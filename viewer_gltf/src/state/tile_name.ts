/** A tile's name for people. Pure. */

/** `row 1, column 4` of a tile of the grid, counted from 1; else the name that its maker gave it. */
export function tileName(id: string): string {
  const found = /^r(\d+)_c(\d+)$/.exec(id);
  if (found === null) return id;
  return `row ${Number(found[1]) + 1}, column ${Number(found[2]) + 1}`;
}

/** The same where there is no room for words. */
export function shortTileName(id: string): string {
  return tileName(id).replace("row ", "").replace(", column ", "·");
}
