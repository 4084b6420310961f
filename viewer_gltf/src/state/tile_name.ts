/** A tile's name for people. Pure. */

/** The parts of a tile from which its name for people is made. */
export type NamedTile = Readonly<{ id: string; name?: string }>;

/**
 * The name that the stage gives a tile. Without one, `row 1, column 4` of a tile of the grid, counted from 1, with its
 * layer in z if there are several; else its id.
 */
export function tileName(id: string, tiles: readonly NamedTile[]): string {
  return tiles.find((tile) => tile.id === id)?.name ?? placeInGrid(id);
}

/** The same name with a capital letter, for places where it stands alone. */
export function tileTitle(id: string, tiles: readonly NamedTile[]): string {
  return tiles.find((tile) => tile.id === id)?.name ?? `Tile in ${placeInGrid(id)}`;
}

function placeInGrid(id: string): string {
  const found = /^r(\d+)_c(\d+)(?:_z(\d+))?$/.exec(id);
  if (found === null) return id;
  const [row, column, layer] = found.slice(1).map((index) => Number(index) + 1);
  return `row ${row}, column ${column}${found[3] === undefined ? "" : `, layer ${layer}`}`;
}

/** A tile's place in the grid where there is no room for words. */
export function shortTileName(id: string): string {
  return placeInGrid(id)
    .replace("row ", "")
    .replace(/, (column|layer) /g, "·");
}
