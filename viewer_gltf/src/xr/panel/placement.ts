/** Where in the room the panel and the bar are, as directions from the eye. Radians. Pure. */
import { type Matrix4, Vector3 } from "three";

/** From the eye: to the right of -z, and up. */
export type Bearing = Readonly<{ yaw: number; pitch: number }>;

const DEG = Math.PI / 180;
/** Distance of the panel and of the bar from the eye, m: what they measure in legibility.test.ts is seen from there. */
export const PANEL_DISTANCE_M = 1.2;

/** The specimen stands before the eyes in the dark, or over a table in the user's own room, seen by eyes or on a screen. */
export type Setting = "before-eyes" | "over-table" | "in-hand";

type Places = Readonly<{
  /** Pitch of the panel's middle, radians. */
  panel: number;
  /** Pitch of the bar, radians, while the panel is closed, and while it is open. */
  bar: readonly [closed: number, open: number];
  /** Pitches of a head, radians, that looks for the bar, so that the bar waits: from and to. */
  waits: readonly [number, number];
  /** Distance of both from the eye, m. */
  distance_m: number;
}>;

/**
 * - Before the eyes the bar is as far below a level gaze as eyes and neck go without thinking. The panel begins
 *   below the specimen's middle, so that every tile can still be gazed at, and the bar hangs under it.
 * - A specimen on a table fills what a head that looks down can reach. So panel and bar are over it, and the bar stays
 *   where it is.
 * - A screen in a hand shows the table alone. So the panel is before it, as small as that picture needs, and the bar is
 *   at the table's near edge.
 */
const PLACES: Readonly<Record<Setting, Places>> = {
  "before-eyes": {
    panel: -27.5 * DEG,
    bar: [-30 * DEG, -53.4 * DEG],
    waits: [-90 * DEG, -20 * DEG],
    distance_m: PANEL_DISTANCE_M,
  },
  "over-table": {
    panel: 16 * DEG,
    bar: [-9.7 * DEG, -9.7 * DEG],
    waits: [-19 * DEG, 0],
    distance_m: PANEL_DISTANCE_M,
  },
  "in-hand": {
    panel: -41 * DEG,
    bar: [-57.5 * DEG, -57.5 * DEG],
    waits: [-90 * DEG, -47 * DEG],
    distance_m: 2,
  },
};
/** A head that looks steeper, radians, up or down, has no clear heading. */
const STEEP = 75 * DEG;
/** The head turns this far, radians, before the bar follows. */
const SLACK = 15 * DEG;
const FOLLOW_PER_S = 4;

/** From the gaze down to a notice's middle, radians: the notice covers nothing of interest. */
const NOTICE_BELOW = 20 * DEG;
/** Lowest pitch of a notice, radians: a user who looks at the floor reads it there. */
const NOTICE_LOWEST = -60 * DEG;

/** Between a notice and the menu's rows below it, radians. */
const NOTICE_GAP = 0.5 * DEG;
/** Most that a notice lies above the gaze, radians: farther up, lenses of a Cardboard show text unsharp. */
const MOST_ABOVE = 25 * DEG;

export function noticeBearing({ yaw, pitch }: Bearing): Bearing {
  return { yaw, pitch: Math.max(pitch - NOTICE_BELOW, Math.min(pitch, NOTICE_LOWEST)) };
}

/**
 * Where the middle of a notice goes that must cover nothing from a place on down: the texts end just above it.
 *
 * @param end from the notice's middle up to the lower end of its texts, radians
 */
export function noticeAbove({ yaw, pitch }: Bearing, end: number): Bearing {
  return { yaw, pitch: pitch + NOTICE_GAP - end };
}

/** Whether a notice at the upper edge of the menu's rows is seen without a turn of the head. */
export function isNear(edge: Bearing, gaze: Bearing): boolean {
  return edge.pitch - gaze.pitch < MOST_ABOVE;
}

export function barPitch(setting: Setting, isOpen: boolean): number {
  const [closed, open] = PLACES[setting].bar;
  return isOpen ? open : closed;
}

/** Distance of the panel and of the bar from the eye, m. */
export function panelDistance_m(setting: Setting): number {
  return PLACES[setting].distance_m;
}

export function bearingOf(direction: Vector3): Bearing {
  const { x, y, z } = direction;
  return { yaw: Math.atan2(x, -z), pitch: Math.atan2(y, Math.hypot(x, z)) };
}

export function pointAt({ yaw, pitch }: Bearing, eye: Vector3, distance_m: number): Vector3 {
  const flat = Math.cos(pitch);
  const direction = new Vector3(flat * Math.sin(yaw), Math.sin(pitch), -flat * Math.cos(yaw));
  return direction.multiplyScalar(distance_m).add(eye);
}

export function headBearing(head: Matrix4): Bearing {
  return bearingOf(new Vector3(0, 0, -1).transformDirection(head));
}

/** -pi..pi */
function wrapped(angle: number): number {
  return Math.atan2(Math.sin(angle), Math.cos(angle));
}

/** Where the panel's middle goes: above or below the gaze, whichever way its user has turned. */
export function panelBearing(
  { yaw, pitch }: Bearing,
  barYaw: number,
  setting: Setting = "before-eyes",
): Bearing {
  return { yaw: Math.abs(pitch) < STEEP ? yaw : barYaw, pitch: PLACES[setting].panel };
}

/** The bar stays where it is until the head has turned away, and while it is looked for. */
export function followHead(
  yaw: number,
  head: Bearing,
  dt_s: number,
  setting: Setting = "before-eyes",
): number {
  const [from, to] = PLACES[setting].waits;
  if (head.pitch > from && head.pitch < to) return yaw;
  const away = wrapped(head.yaw - yaw);
  const over = Math.sign(away) * Math.max(0, Math.abs(away) - SLACK);
  return wrapped(yaw + over * Math.min(1, FOLLOW_PER_S * dt_s));
}
