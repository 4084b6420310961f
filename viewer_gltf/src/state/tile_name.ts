/** Names of tiles for users. Pure. */

/** The fields of a tile from which its name is made. */
export type NamedTile = Readonly<{ id: string; name?: string }>;

/**
 * Returns the name that the stage gives a tile. Without one, returns the place in the grid, counted
 * from 1: `row 1, column 4`, with the layer in z if there are several. Other tiles are named by
 * their id.
 */
export function tileName(id: string, tiles: readonly NamedTile[]): string {
  return tiles.find((tile) => tile.id === id)?.name ?? placeInGrid(id);
}

/** Returns the name with a capital letter, for headings. */
export function tileTitle(id: string, tiles: readonly NamedTile[]): string {
  return tiles.find((tile) => tile.id === id)?.name ?? `Tile in ${placeInGrid(id)}`;
}

function placeInGrid(id: string): string {
  const found = /^r(\d+)_c(\d+)(?:_z(\d+))?$/.exec(id);
  if (found === null) return id;
  const [row, column, layer] = found.slice(1).map((index) => Number(index) + 1);
  return `row ${row}, column ${column}${found[3] === undefined ? "" : `, layer ${layer}`}`;
}

/** Returns the place of a tile in the grid as numbers, where there is no space for words. */
export function shortTileName(id: string): string {
  return placeInGrid(id)
    .replace("row ", "")
    .replace(/, (column|layer) /g, "·");
}
