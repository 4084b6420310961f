/** Options, colours and tiles to choose from, on the panel's canvas. Pure. */
import { shortTileName } from "../../state/tile_name";
import type { Choice, Colour, TileMap } from "../controls";
import { nextColour } from "../palettes";
import {
  type Block,
  box,
  GAP,
  type Mark,
  type Rect,
  type Region,
  ROW,
  SMALL,
  split,
  text,
} from "./draw_list";
import { captioned, LABEL, one, region, toneOf, unlessRefused } from "./parts";

/** Largest cell, px. A map of few tiles does not fill the panel. */
const LARGEST_CELL = 160;
const MAP_HEIGHT = 5 * ROW;
/** Smallest cell, px: 4.5 degrees at 1.2 m, so that a gaze can hit it. */
const SMALLEST_CELL = 78;
/**
 * Number that a tile map counts toward MAX_TARGETS of a page, which leaves two for switches beside
 * it.
 */
const MAP_TARGETS = 4;

/** Draws options side by side. */
export function chips(choice: Choice, width: number): Block {
  const rects = split({ x: 0, y: 0, width, height: ROW }, choice.options.length);
  const marks: Mark[] = [];
  const regions: Region[] = [];
  choice.options.forEach(({ value, label }, i) => {
    const isChosen = value === choice.value;
    marks.push(
      box(rects[i], isChosen ? "accent" : "raised"),
      text(rects[i], label, { align: "center", tone: toneOf(choice, isChosen) }),
    );
    regions.push(region(`${choice.id}=${value}`, label, rects[i], () => choice.to(value)));
  });
  return captioned(choice.label, width, one(marks, unlessRefused(choice, regions)));
}

/** Draws a row for each of a few options with long names. */
export function optionRows(choice: Choice, width: number): readonly Block[] {
  return choice.options.map(({ value, label }) => {
    const row: Rect = { x: 0, y: 0, width, height: ROW };
    const isChosen = value === choice.value;
    const marks = [
      box(row, isChosen ? "accent" : "raised"),
      text(row, label, { tone: toneOf(choice, isChosen) }),
    ];
    const name = isChosen ? `${label}, chosen` : label;
    const place = region(`${choice.id}=${value}`, name, row, () => choice.to(value));
    return one(marks, unlessRefused(choice, [place]));
  });
}

/** Draws the present one of many options between two arrows. */
export function stepper(choice: Choice, row: Rect): Block {
  const { options, value, id } = choice;
  const at = options.findIndex((each) => each.value === value);
  const step = (by: number) => {
    const { length } = options;
    return () => choice.to(options[(Math.max(at, 0) + by + length) % length].value);
  };
  const left = row.width * LABEL;
  const label: Rect = { ...row, width: left };
  const before: Rect = { ...row, x: row.x + left, width: ROW };
  const after: Rect = { ...row, x: row.x + row.width - ROW, width: ROW };
  const middle: Rect = { ...row, x: before.x + ROW, width: after.x - before.x - ROW };
  const tone = toneOf(choice);
  const marks = [
    text(label, choice.label, { tone, size: SMALL, lines: 2 }),
    box(before, "raised"),
    text(before, "‹", { align: "center", tone }),
    text(middle, options[at]?.label ?? value, { align: "center", tone, lines: 2 }),
    box(after, "raised"),
    text(after, "›", { align: "center", tone }),
  ];
  const isAlone = options.length < 2;
  return one(
    marks,
    isAlone
      ? []
      : unlessRefused(choice, [
          region(`${id}=before`, `${choice.label}: previous`, before, step(-1)),
          region(`${id}=after`, `${choice.label}: next`, after, step(1)),
        ]).map((each) => ({ ...each, isStep: true })),
  );
}

/** Draws a colour, or the colours that are shown in its place. */
export function swatchMarks({ value, shows = [] }: Colour, rect: Rect): readonly Mark[] {
  const width = rect.width / shows.length;
  const stripes = shows.map((hex, i): Mark => {
    const stripe = { ...rect, x: rect.x + i * width, width };
    return { kind: "box", rect: stripe, fill: toneOfHex(hex), stroke: null, radius: 0 };
  });
  return [box(rect, toneOfHex(value), "line"), ...stripes];
}

/** Draws a swatch; choosing it takes the next colour of the palettes. */
export function nextSwatch(colour: Colour, rect: Rect): Block {
  const to = () => colour.to(nextColour(colour.value));
  const place = region(colour.id, colour.name ?? colour.label, rect, to);
  return one(swatchMarks(colour, rect), unlessRefused(colour, [place]));
}

/** Draws colours side by side. */
export function swatches(colour: Colour, hexes: readonly string[], row: Rect): Block {
  const rects = split(row, hexes.length);
  const marks = hexes.map((hex, i) =>
    box(rects[i], toneOfHex(hex), hex === colour.value ? "text" : "line"),
  );
  const regions = hexes.map((hex, i) =>
    region(`${colour.id}=${hex}`, hex, rects[i], () => colour.to(hex)),
  );
  return one(marks, unlessRefused(colour, regions));
}

export function palettes(colour: Colour, width: number): readonly Block[] {
  return colour.palettes.map(({ name, colors }) => {
    const row = { x: 0, y: 0, width, height: ROW };
    const hexes = colors.map(({ hex }) => hex);
    const { marks, regions } = swatches(colour, hexes, row);
    const named = regions.map((each, i) => ({
      ...each,
      id: `${colour.id}=${name}=${hexes[i]}`,
      label: colors[i].name,
    }));
    return { ...captioned(name, width, one(marks, named)), targets: 1 };
  });
}

function toneOfHex(hex: string): `#${string}` {
  return `#${hex.slice(1)}`;
}

export function mapBlock(map: TileMap, width: number): Block {
  const cell = Math.min(LARGEST_CELL, width / map.columns, MAP_HEIGHT / map.rows);
  if (cell < SMALLEST_CELL) return stepper(asChoice(map), { x: 0, y: 0, width, height: ROW });
  const left = (width - cell * map.columns) / 2;
  const rectOf = (row: number, column: number): Rect => ({
    x: left + column * cell,
    y: row * cell,
    width: cell,
    height: cell,
  });
  const marks: Mark[] = [];
  const regions: Region[] = [];
  for (const tile of map.tiles) {
    const rect = rectOf(tile.row, tile.column);
    const isChosen = tile.isSelected || tile.isIsolated;
    marks.push(box(rect, isChosen ? "accent" : "raised", tile.isFocus ? "text" : "line"));
    const label = tile.isIsolated ? "only" : shortTileName(tile.id);
    const tone = isChosen ? "ink" : "dim";
    marks.push(text(rect, label, { align: "center", size: SMALL, tone }));
    regions.push(region(`${map.id}=${tile.id}`, tile.name, rect, () => map.to(tile.id)));
  }
  const height = Math.ceil(cell * map.rows) + GAP;
  const block = { ...one(marks, unlessRefused(map, regions), height), targets: MAP_TARGETS };
  return captioned(map.label, width, block);
}

/** Returns the tiles as a choice, which starts from the isolated, selected or gazed tile. */
function asChoice({ id, tiles, refusal, to }: TileMap): Choice {
  const now =
    tiles.find(({ isIsolated }) => isIsolated) ??
    tiles.find(({ isSelected }) => isSelected) ??
    tiles.find(({ isFocus }) => isFocus);
  const options = tiles.map((tile) => ({ value: tile.id, label: tile.name }));
  const value = now?.id ?? "";
  return { kind: "choice", id, label: "Tile", value, options, isInline: false, refusal, to };
}
