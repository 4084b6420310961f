/** The summary of an item, which the server makes before any long computation. Pure. */
import { positive, textOf } from "./inbox_state";

export type Channel = Readonly<{
  id: string;
  name: string;
  /** Colour as #rrggbb; empty: none is known. */
  color: string;
  hasSurface: boolean;
}>;

/** A setting with one value out of a few. */
export type Choice = Readonly<{ value: string; options: readonly Option[] }>;
export type Option = Readonly<{ id: string; text: string }>;

export type Understood = Readonly<{
  title: string;
  format: string;
  modality: string;
  /** Number of voxels along x, y, z. */
  voxels: readonly number[];
  spacing_um: readonly number[];
  sizeText: string;
  tiles: number;
  bytesEstimate: number;
  notes: readonly string[];
  channels: readonly Channel[];
  /** The middle slices: the axis across each, the plane's name, and the image's path in the item's folder. */
  slices: readonly Readonly<{ axis: string; name: string; image: string }>[];
  preset: Choice | null;
  series: Choice | null;
  background: Choice | null;
  /** Spacing along x, y, z; empty: it can't be changed. */
  chosenSpacing_um: readonly number[];
  /** IDs of the channels that are built. */
  chosenChannels: readonly string[];
  channelOptions: readonly Option[];
}>;

type Found = Readonly<Record<string, unknown>>;

const listOf = (found: unknown): readonly unknown[] => (Array.isArray(found) ? found : []);
const foundOf = (found: unknown): Found =>
  typeof found === "object" && found !== null ? (found as Found) : {};
const numbersOf = (found: unknown) => listOf(found).map((each) => positive(each, 0));
const textsOf = (found: unknown) =>
  listOf(found).flatMap((each) => (typeof each === "string" ? [each] : []));

export function readUnderstood(answer: unknown): Understood {
  const found = foundOf(answer);
  const choices = foundOf(found.choices);
  const channels = foundOf(choices.channels);
  return {
    title: textOf(found.title),
    format: textOf(found.format),
    modality: textOf(found.modality),
    voxels: numbersOf(found.size_voxels),
    spacing_um: numbersOf(found.spacing_um),
    sizeText: textOf(found.size_text).replaceAll(" x ", " × ").replace(/ um$/, " µm"),
    tiles: positive(found.tiles, 0),
    bytesEstimate: positive(found.bytes_estimate, 0),
    notes: textsOf(found.notes),
    channels: listOf(found.channels).map(foundOf).map(readChannel),
    slices: listOf(found.slices).map(foundOf).flatMap(readSlice),
    preset: readChoice(choices.preset),
    series: readChoice(choices.series),
    background: readChoice(choices.background),
    chosenSpacing_um: numbersOf(foundOf(choices.spacing_um).value),
    chosenChannels: textsOf(channels.value),
    channelOptions: optionsOf(channels.options),
  };
}

function readChannel(found: Found): Channel {
  const color = textOf(found.color);
  return {
    id: textOf(found.id),
    name: textOf(found.name),
    color: /^#[0-9a-f]{6}$/i.test(color) ? color : "",
    hasSurface: found.has_surface === true,
  };
}

function readSlice({ axis, name, image }: Found): Understood["slices"] {
  const path = textOf(image);
  return /^slices\/[\w-]+\.png$/.test(path)
    ? [{ axis: textOf(axis), name: textOf(name) || textOf(axis), image: path }]
    : [];
}

/** Returns null if there is nothing to choose. */
function readChoice(found: unknown): Choice | null {
  const { value, options } = foundOf(found);
  const read = optionsOf(options);
  return read.length === 0 ? null : { value: textOf(value), options: read };
}

/** Reads options, each of which is a text, or an object with an ID and a text. */
function optionsOf(found: unknown): readonly Option[] {
  return listOf(found).map((each) => {
    if (typeof each === "string") return { id: each, text: each };
    const { id, text, name } = foundOf(each);
    return { id: textOf(id), text: textOf(text) || textOf(name) || textOf(id) };
  });
}
