/**
 * Measurements: distances, angles and lines through several points, with names. `measured` holds
 * the points of the measurement in progress; `measurements` lists the finished ones. Pure.
 */
import { distanceBetween } from "../math/distance";
import type { Vec3 } from "../math/vec3";
import type { MeasureKind } from "./parameters/tools";

export type Measurement = Readonly<{ name: string; kind: MeasureKind; points: readonly Vec3[] }>;

export type Measuring = Readonly<{
  /** Points of the measurement in progress, um; it may be complete. */
  measured: readonly Vec3[];
  /** Kind of the measurement in progress. */
  measuredAs: MeasureKind;
  /** Kind of the next measurement. */
  measureKind: MeasureKind;
  /** Finished measurements, oldest first. */
  measurements: readonly Measurement[];
}>;

export const MAX_MEASUREMENTS = 100;
/** Largest number of points of a line. */
export const MAX_POINTS = 64;
const LONGEST_NAME = 60;

export const NAMES: Readonly<Record<MeasureKind, string>> = {
  distance: "Distance",
  angle: "Angle",
  line: "Line",
};
const MAX_POINTS_OF: Readonly<Record<MeasureKind, number>> = {
  distance: 2,
  angle: 3,
  line: MAX_POINTS,
};
const MIN_POINTS: Readonly<Record<MeasureKind, number>> = { distance: 2, angle: 3, line: 2 };

/** Returns the number of points that are still missing; 0: the measurement has a value. */
export function missing(kind: MeasureKind, points: readonly Vec3[]): number {
  return Math.max(0, MIN_POINTS[kind] - points.length);
}

/**
 * Adds a point to the measurement in progress. If that is complete or of another kind, begins
 * another.
 */
export function withPoint<S extends Measuring>(state: S, point: Vec3): S {
  const { measured, measuredAs, measureKind } = state;
  const goesOn =
    measured.length > 0 &&
    measured.length < MAX_POINTS_OF[measuredAs] &&
    measuredAs === measureKind;
  if (goesOn) return { ...state, measured: [...measured, point] };
  return { ...finished(state), measured: [point], measuredAs: measureKind };
}

/** Moves the measurement in progress to the list if it has a value; else drops its points. */
export function finished<S extends Measuring>(state: S): S {
  const { measured, measuredAs, measurements } = state;
  if (missing(measuredAs, measured) > 0) {
    return measured.length === 0 ? state : { ...state, measured: [] };
  }
  const made = { name: freeName(measuredAs, measurements), kind: measuredAs, points: measured };
  const kept = [...measurements, made].slice(-MAX_MEASUREMENTS);
  return { ...state, measured: [], measurements: kept };
}

/** Returns the first name of a kind with a number that no other measurement has. */
export function freeName(kind: MeasureKind, others: readonly Measurement[]): string {
  const taken = new Set(others.map(({ name }) => name));
  for (let i = 1; ; i++) if (!taken.has(`${NAMES[kind]} ${i}`)) return `${NAMES[kind]} ${i}`;
}

/**
 * Returns the list without measurements that lack points, shortened to the largest number of
 * measurements and of points.
 */
export function withinLimits(list: readonly Measurement[]): readonly Measurement[] {
  return list
    .filter(({ kind, points }) => missing(kind, points) === 0)
    .slice(-MAX_MEASUREMENTS)
    .map(({ name, kind, points }) => ({
      name: name.slice(0, LONGEST_NAME),
      kind,
      points: points.slice(0, MAX_POINTS_OF[kind]),
    }));
}

/** Returns all measurements that have a value, newest last. */
export function allOf(state: Measuring): readonly Measurement[] {
  return finished(state).measurements;
}

/** Returns the length of the line through the points, um. */
export function lengthOf(points: readonly Vec3[]): number {
  return points.slice(1).reduce((sum, point, i) => sum + distanceBetween(points[i], point), 0);
}

/**
 * Returns the angle at the second of three points, degrees; null if it coincides with another
 * point.
 */
export function angleOf([a, b, c]: readonly Vec3[]): number | null {
  const [u, v] = [a, c].map((end) => [end[0] - b[0], end[1] - b[1], end[2] - b[2]]);
  const cross = Math.hypot(
    u[1] * v[2] - u[2] * v[1],
    u[2] * v[0] - u[0] * v[2],
    u[0] * v[1] - u[1] * v[0],
  );
  const along = u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
  if (cross === 0 && along === 0) return null;
  return (Math.atan2(cross, along) * 180) / Math.PI; // atan2 is exact near 0 and 180 degrees, where acos is not
}

/**
 * Returns CSV (RFC 4180) with one line for each measurement and its points in um of the world. A
 * name that a spreadsheet would read as a formula gets a leading apostrophe.
 */
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
