/**
 * Writes and reads measurements in an address: `d:Name:x,y,z,x,y,z+a:...`. Each has a kind (d(istance), a(ngle) or
 * l(ine)), a name and its points in um. Pure.
 */
import type { Vec3 } from "../math/vec3";
import {
  allOf,
  type Measurement,
  type Measuring,
  missing,
  withinLimits,
} from "../state/measurements";
import type { MeasureKind } from "../state/parameters/tools";
import { readNumbers, written } from "./numbers";

const LETTERS: readonly (readonly [string, MeasureKind])[] = [
  ["d", "distance"],
  ["a", "angle"],
  ["l", "line"],
];

/** Returns the list as text, and the points of an unfinished measurement or a new distance, which the list leaves out. */
export function linkedMeasurements(state: Measuring): readonly [string, readonly Vec3[]] {
  const { measured, measuredAs, measureKind, measurements } = state;
  const isDone = missing(measuredAs, measured) === 0;
  const isApart = !isDone || (measuredAs === "distance" && measureKind === "distance");
  const list = isApart ? measurements : allOf(state);
  const text = list
    .map(({ name, kind, points }) => {
      const letter = LETTERS.find(([, each]) => each === kind)?.[0];
      return `${letter}:${encodeURIComponent(name)}:${written(points.flat())}`;
    })
    .join("+");
  return [text, isApart ? measured : []];
}

export function readMeasurements(
  text: string,
  within: (point: readonly number[]) => Vec3,
): Readonly<{ read: readonly Measurement[]; unread: readonly string[] }> {
  const read: Measurement[] = [];
  const unread: string[] = [];
  for (const entry of text.split("+")) {
    const made = readOne(entry, within);
    if (made === null) unread.push(entry);
    else read.push(made);
  }
  return { read: withinLimits(read), unread };
}

function readOne(entry: string, within: (point: readonly number[]) => Vec3): Measurement | null {
  const [letter, named = "", list = ""] = entry.split(":");
  const kind = LETTERS.find(([each]) => each === letter)?.[1];
  const count = list.split(",").length;
  const numbers = count % 3 === 0 ? readNumbers(list, count) : null;
  if (kind === undefined || numbers === null) return null;
  const points = Array.from({ length: count / 3 }, (_, i) =>
    within(numbers.slice(3 * i, 3 * i + 3)),
  );
  if (missing(kind, points) > 0) return null;
  try {
    return { name: decodeURIComponent(named), kind, points };
  } catch (error) {
    if (error instanceof URIError) return null;
    throw error;
  }
}
