/**
 * Reads the metadata of an OME-Zarr image: axes, levels and channels. Pure.
 *
 * Versions 0.4 and 0.5 are read, and older ones, which state no spacing. Follows
 * pipeline/stereocell/read/formats/ome_zarr/ngff.py.
 *
 * References: https://ngff.openmicroscopy.org; RFC-4 (orientation)
 */
import { fromHex, type Rgb } from "../math/color";
import { type Triple, triple } from "./coarse_volume";
import type { Window } from "./find_window";
import { SourceError } from "./source_error";

const SPATIAL = ["z", "y", "x"] as const;

/** One resolution level of the pyramid. */
export type NgffLevel = Readonly<{
  path: string;
  /** Distance between voxels (z, y, x), um, and centre of the first one; null if not stated. */
  scale_um: Triple | null;
  shift_um: Triple | null;
}>;

export type NgffChannel = Readonly<{
  label: string | null;
  /** Linear RGB. */
  color: Rgb | null;
  window: Window | null;
  active: boolean | null;
}>;

export type NgffImage = Readonly<{
  /** Names of the axes, slowest first, in lower case: t, c, z, y, x in any order. */
  axes: readonly string[];
  /** Resolution levels of the pyramid, finest first. */
  levels: readonly NgffLevel[];
  /** The channels that the metadata describe; the image may have more. */
  channels: readonly NgffChannel[];
  /** Directions in which the indices of z, y and x grow, as `left-to-right`; empty: not stated. */
  orientations: readonly [string, string, string];
  notes: readonly string[];
}>;

type Table = Readonly<Record<string, unknown>>;

const UM: Readonly<Record<string, number>> = {
  angstrom: 1e-4,
  picometer: 1e-6,
  nanometer: 1e-3,
  nm: 1e-3,
  micrometer: 1,
  micron: 1,
  um: 1,
  "\u00b5m": 1,
  "\u03bcm": 1,
  millimeter: 1e3,
  mm: 1e3,
  centimeter: 1e4,
  cm: 1e4,
  meter: 1e6,
  m: 1e6,
};

/** Returns the size of a unit of length in um; null if it is missing, or is not a unit of length. */
export function umPer(unit: unknown): number | null {
  if (typeof unit !== "string") return null;
  const name = unit.trim().toLowerCase().replace("metre", "meter");
  return UM[unit] ?? UM[name] ?? UM[name.replace(/s$/, "")] ?? null;
}

function tableOf(value: unknown): Table {
  return value !== null && typeof value === "object" && !Array.isArray(value)
    ? (value as Table)
    : {};
}

const listOf = (value: unknown): readonly unknown[] => (Array.isArray(value) ? value : []);

/**
 * Reads the image that a group's attributes describe.
 *
 * @param where the source, for messages
 * Throws SourceError.
 */
export function parseNgff(attributes: unknown, where: string): NgffImage {
  const top = tableOf(attributes);
  const ome = "ome" in top ? tableOf(top.ome) : top;
  const images = listOf(ome.multiscales);
  if (images.length === 0) throw new SourceError(`${where}: ${otherKind(ome)}.`);
  const image = tableOf(images[0]);
  const version = String(image.version ?? ome.version ?? "");
  const notes: string[] = [];
  if (images.length > 1) {
    notes.push(`Only the first of ${images.length} images is shown.`);
  }
  const { axes, names } = axesOf(image, where);
  const levels = listOf(image.datasets).map((dataset) =>
    levelOf(tableOf(dataset), image, axes, where),
  );
  if (levels.length === 0) {
    throw new SourceError(
      `${where}: multiscales[0].datasets is empty, expected at least one level.`,
    );
  }
  if (levels[0].scale_um === null) {
    const title = `OME-Zarr ${version}`.trim();
    notes.push(
      `${title} states no voxel spacing with a unit. The viewer assumes 1 µm, so lengths may be wrong.`,
    );
  }
  const oriented = SPATIAL.map((axis) => orientationOf(axes[names.indexOf(axis)]));
  return {
    ...{ axes: names, levels, notes },
    channels: listOf(tableOf(ome.omero).channels).map((entry) => channelOf(tableOf(entry))),
    orientations: [oriented[0], oriented[1], oriented[2]],
  };
}

/** Describes a group without `multiscales`, and names what to open instead. */
function otherKind(ome: Table): string {
  if ("plate" in ome)
    return "found a plate, expected an image: add the path of a field, for example A/1/0";
  if ("well" in ome)
    return "found a well, expected an image: add the path of a field, for example 0";
  if ("bioformats2raw.layout" in ome || "series" in ome) {
    return "found several images, expected one: add the path of an image, for example /0";
  }
  return "found no `multiscales`, expected the group of an OME-Zarr image";
}

function axesOf(image: Table, where: string): { axes: readonly Table[]; names: readonly string[] } {
  // Versions 0.1 and 0.2 do not list the axes, and 0.3 lists only their names.
  const stated = image.axes === undefined ? ["t", "c", ...SPATIAL] : listOf(image.axes);
  const axes = stated.map((axis) => (typeof axis === "string" ? { name: axis } : tableOf(axis)));
  const names = axes.map(({ name }) => String(name).toLowerCase());
  const isKnown = names.every((name) => ["t", "c", ...SPATIAL].includes(name));
  if (!isKnown || new Set(names).size < names.length) {
    throw new SourceError(
      `${where}: axes are ${names.join(", ")}, expected z, y and x, and optionally t and c.`,
    );
  }
  const missing = SPATIAL.find((axis) => !names.includes(axis));
  if (missing !== undefined) {
    throw new SourceError(`${where}: axes lack ${missing}, expected a volume with z, y and x.`);
  }
  return { axes, names };
}

function levelOf(dataset: Table, image: Table, axes: readonly Table[], where: string): NgffLevel {
  let scale: readonly number[] | null = null;
  let shift: readonly number[] | null = null;
  const steps = [dataset, image].flatMap((one) => listOf(one.coordinateTransformations));
  for (const step of steps.map(tableOf)) {
    const { type } = step;
    if (type === "identity") continue;
    const values = listOf(step[String(type)]).map(Number);
    const isRead = type === "scale" || type === "translation";
    if (!isRead || values.length !== axes.length || !values.every(Number.isFinite)) {
      throw new SourceError(
        `${where}: coordinateTransformations has ${JSON.stringify(step).slice(0, 80)}, ` +
          `expected scales and translations of ${axes.length} numbers.`,
      );
    }
    if (type === "scale") {
      scale = values.map((value, i) => value * (scale?.[i] ?? 1));
      if (shift !== null) shift = shift.map((value, i) => value * values[i]);
    } else {
      shift = values.map((value, i) => value + (shift?.[i] ?? 0));
    }
  }
  const path = String(dataset.path ?? "");
  if (path === "" || path.split("/").includes("..")) {
    throw new SourceError(
      `${where}: datasets: path is "${path}", expected a level inside the image.`,
    );
  }
  const scale_um = lengths(scale, axes);
  if (scale_um?.some((length) => !(length > 0))) {
    throw new SourceError(
      `${where}: level ${path}: scale is ${scale_um.join(", ")} um, expected lengths above 0.`,
    );
  }
  return { path, scale_um, shift_um: lengths(shift, axes) };
}

/** Returns lengths (z, y, x), um; null if one is missing, has no unit or has a unit that is not a length. */
function lengths(values: readonly number[] | null, axes: readonly Table[]): Triple | null {
  if (values === null) return null;
  const found = SPATIAL.map((name) => {
    const at = axes.findIndex((axis) => String(axis.name).toLowerCase() === name);
    const unit = umPer(axes[at].unit);
    return unit === null ? null : values[at] * unit;
  });
  const [z, y, x] = found;
  return z === null || y === null || x === null ? null : [z, y, x];
}

function orientationOf(axis: Table): string {
  const { type, value } = tableOf(axis.orientation);
  return type === "anatomical" ? String(value).trim().toLowerCase() : "";
}

function channelOf(entry: Table): NgffChannel {
  const label = typeof entry.label === "string" ? entry.label.trim() : "";
  const { start, end } = tableOf(entry.window);
  const isWindow = Number.isFinite(start) && Number.isFinite(end) && Number(end) > Number(start);
  return {
    label: label || null,
    color: colorOf(entry.color),
    window: isWindow ? [Number(start), Number(end)] : null,
    active: typeof entry.active === "boolean" ? entry.active : null,
  };
}

function colorOf(text: unknown): Rgb | null {
  const match = /^#?([0-9a-f]{6})(?:[0-9a-f]{2})?$/i.exec(String(text));
  return match === null ? null : fromHex(`#${match[1]}`);
}

/** Axis of LPS (left, posterior, superior) along which each side lies, and its sign. */
const SIDES: Readonly<Record<string, readonly [0 | 1 | 2, 1 | -1]>> = {
  ...{ left: [0, 1], right: [0, -1] },
  ...{ posterior: [1, 1], anterior: [1, -1], dorsal: [1, 1], ventral: [1, -1] },
  ...{ superior: [2, 1], inferior: [2, -1] },
  ...{ cranial: [2, 1], rostral: [2, 1], caudal: [2, -1] },
};

/**
 * Returns the directions of the stored axes (z, y, x) as unit vectors in LPS; null if they are not stated, or are not
 * three different axes of the body.
 */
export function directionsOf(orientations: readonly string[]): readonly Triple[] | null {
  const found = orientations.map((text) => {
    const [start, end] = text.split("-to-").map((side) => SIDES[side]);
    const isWay = start !== undefined && end !== undefined && start[0] === end[0];
    return isWay && start[1] !== end[1] ? end : null;
  });
  if (new Set(found.map((one) => one?.[0])).size < 3 || found.includes(null)) return null;
  return found.map((one) => triple((i) => (one !== null && one[0] === i ? one[1] : 0)));
}
