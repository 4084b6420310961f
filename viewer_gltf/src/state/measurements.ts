/**
 * Measurements: distances, angles and lines through several points, with names. The one that is being made
 * is `measured`; the finished ones are a list. Pure.
 */
import { distanceBetween } from "../math/distance";
import type { Vec3 } from "../math/vec3";
import type { MeasureKind } from "./parameters/tools";

export type Measurement = Readonly<{ name: string; kind: MeasureKind; points: readonly Vec3[] }>;

export type Measuring = Readonly<{
  /** The points of the newest one, um: none, some, or all that it needs. */
  measured: readonly Vec3[];
  /** What the newest one is. */
  measuredAs: MeasureKind;
  /** What the next one will be. */
  measureKind: MeasureKind;
  /** Those before, oldest first. */
  measurements: readonly Measurement[];
}>;

export const MAX_MEASUREMENTS = 100;
/** Most points of a line. */
export const MAX_POINTS = 64;
const LONGEST_NAME = 60;

export const NAMES: Readonly<Record<MeasureKind, string>> = {
  distance: "Distance",
  angle: "Angle",
  line: "Line",
};
const WANTED: Readonly<Record<MeasureKind, number>> = { distance: 2, angle: 3, line: MAX_POINTS };
const MIN_POINTS: Readonly<Record<MeasureKind, number>> = { distance: 2, angle: 3, line: 2 };

/** How many points are missing at least; 0: it measures something. */
export function missing(kind: MeasureKind, points: readonly Vec3[]): number {
  return Math.max(0, MIN_POINTS[kind] - points.length);
}

/** With one more point: of the newest one, or, where that is done, of another. */
export function withPoint<S extends Measuring>(state: S, point: Vec3): S {
  const { measured, measuredAs, measureKind } = state;
  const goesOn =
    measured.length > 0 && measured.length < WANTED[measuredAs] && measuredAs === measureKind;
  if (goesOn) return { ...state, measured: [...measured, point] };
  return { ...finished(state), measured: [point], measuredAs: measureKind };
}

/** The newest one goes to the list, if it measures anything. */
export function finished<S extends Measuring>(state: S): S {
  const { measured, measuredAs, measurements } = state;
  if (missing(measuredAs, measured) > 0) {
    return measured.length === 0 ? state : { ...state, measured: [] };
  }
  const made = { name: freeName(measuredAs, measurements), kind: measuredAs, points: measured };
  const kept = [...measurements, made].slice(-MAX_MEASUREMENTS);
  return { ...state, measured: [], measurements: kept };
}

/** The first name of a kind with a number that no other has. */
export function freeName(kind: MeasureKind, others: readonly Measurement[]): string {
  const taken = new Set(others.map(({ name }) => name));
  for (let i = 1; ; i++) if (!taken.has(`${NAMES[kind]} ${i}`)) return `${NAMES[kind]} ${i}`;
}

/** A list within the limits; what measures nothing is left out. */
export function withinLimits(list: readonly Measurement[]): readonly Measurement[] {
  return list
    .filter(({ kind, points }) => missing(kind, points) === 0)
    .slice(-MAX_MEASUREMENTS)
    .map(({ name, kind, points }) => ({
      name: name.slice(0, LONGEST_NAME),
      kind,
      points: points.slice(0, WANTED[kind]),
    }));
}

/** All that measure something, the newest last. */
export function allOf(state: Measuring): readonly Measurement[] {
  return finished(state).measurements;
}

/** The sum of all stretches, um. */
export function lengthOf(points: readonly Vec3[]): number {
  return points.slice(1).reduce((sum, point, i) => sum + distanceBetween(points[i], point), 0);
}

/** At the second of three points, degrees; null: two of them are one. */
export function angleOf([a, b, c]: readonly Vec3[]): number | null {
  const [u, v] = [a, c].map((end) => [end[0] - b[0], end[1] - b[1], end[2] - b[2]]);
  const cross = Math.hypot(
    u[1] * v[2] - u[2] * v[1],
    u[2] * v[0] - u[0] * v[2],
    u[0] * v[1] - u[1] * v[0],
  );
  const along = u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
  if (cross === 0 && along === 0) return null;
  return (Math.atan2(cross, along) * 180) / Math.PI; // exact near 0 and 180 too
}

/** RFC 4180: a line for each, points in um of the world. A spreadsheet takes no name for a formula. */
export function measurementsCsv(list: readonly Measurement[]): string {
  const most = Math.max(2, ...list.map(({ points }) => points.length));
  const columns = Array.from({ length: most }, (_, i) =>
    ["x", "y", "z"].map((axis) => `${axis}${i + 1}_um`),
  ).flat();
  const rows = list.map(({ name, kind, points }) => {
    const angle = kind === "angle" ? angleOf(points) : null;
    return [
      quoted(name),
      kind,
      kind === "angle" ? "" : number(lengthOf(points)),
      angle === null ? "" : number(angle),
      ...points.flat().map(number),
      ...Array.from({ length: 3 * (most - points.length) }, () => ""),
    ].join(",");
  });
  return [["name", "kind", "length_um", "angle_deg", ...columns].join(","), ...rows, ""].join(
    "\r\n",
  );
}

const number = (value: number) => String(Number(value.toPrecision(9)));

function quoted(text: string): string {
  const safe = /^[=+\-@\t\r]/.test(text) ? `'${text}` : text;
  return /[",\r\n]/.test(safe) ? `"${safe.replaceAll('"', '""')}"` : safe;
}
