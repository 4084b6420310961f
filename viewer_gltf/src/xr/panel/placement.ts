/** Where the panel, the bar and notices are in the scene, as directions from the eye in radians. */
import { type Matrix4, Vector3 } from "three";

/** Direction from the eye: yaw to the right of -z, and pitch upwards. */
export type Bearing = Readonly<{ yaw: number; pitch: number }>;

const DEG = Math.PI / 180;
/**
 * Metres from the eye to the panel and the bar. The sizes in legibility.test.ts hold at this
 * distance.
 */
export const PANEL_DISTANCE_M = 1.2;

/**
 * `before-eyes`: dark scene; `over-table`: the user's own room through a headset; `in-hand`: the
 * user's own room on a screen.
 */
export type Setting = "before-eyes" | "over-table" | "in-hand";

type Places = Readonly<{
  /** Pitch of the panel's middle, radians. */
  panel: number;
  /** Pitch of the bar's middle, radians, while the panel is closed and while it is open. */
  bar: readonly [closed: number, open: number];
  /**
   * Range of head pitches, radians, at which a user looks for the bar, so that the bar stands
   * still.
   */
  waits: readonly [number, number];
  /** Metres from the eye to the panel, and to the bar. */
  distance_m: number;
}>;

/**
 * - `before-eyes`: the bar is as far below a level gaze as eyes and neck move without effort. The
 *   panel begins below the specimen's middle, so that the gaze still reaches every tile. The bar
 *   hangs below the panel.
 * - `over-table`: the specimen fills the view of a user who looks down, so panel and bar are above
 *   it, and the bar stays in place.
 * - `in-hand`: the screen shows only the table. The panel is in front of it, small enough for the
 *   screen, and the bar is at the near edge of the table.
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
/** Radians. A head that looks up or down more steeply has no clear heading. */
const STEEP = 75 * DEG;
/** Radians that the head turns before the bar follows. */
const SLACK = 15 * DEG;
/** Share of the remaining angle that the bar turns, per second. */
const FOLLOW_PER_S = 4;

/**
 * Radians from the gaze down to a notice's middle, so that the notice does not cover what is looked
 * at.
 */
const NOTICE_BELOW = 20 * DEG;
/** Lowest pitch of a notice, radians, unless the gaze itself is lower. */
const NOTICE_LOWEST = -60 * DEG;

/** Radians between a notice and the menu's rows below it. */
const NOTICE_GAP = 0.5 * DEG;
/**
 * Radians. Largest angle of a notice above the gaze: farther up, a Cardboard's lenses blur text.
 */
const MOST_ABOVE = 25 * DEG;

export function noticeBearing({ yaw, pitch }: Bearing): Bearing {
  return { yaw, pitch: Math.max(pitch - NOTICE_BELOW, Math.min(pitch, NOTICE_LOWEST)) };
}

/**
 * Returns where the middle of a notice goes so that its texts end just above a place.
 *
 * @param end angle from the notice's middle up to the lower end of its texts, radians
 */
export function noticeAbove({ yaw, pitch }: Bearing, end: number): Bearing {
  return { yaw, pitch: pitch + NOTICE_GAP - end };
}

/** Whether a notice at the upper edge of the menu's rows is visible without turning the head. */
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

/** Returns an equivalent angle, radians, within -pi to pi. */
function wrapped(angle: number): number {
  return Math.atan2(Math.sin(angle), Math.cos(angle));
}

/** Direction of the panel's middle: at the setting's pitch, in the user's heading. */
export function panelBearing(
  { yaw, pitch }: Bearing,
  barYaw: number,
  setting: Setting = "before-eyes",
): Bearing {
  return { yaw: Math.abs(pitch) < STEEP ? yaw : barYaw, pitch: PLACES[setting].panel };
}

/**
 * Returns the bar's new yaw. The bar follows once the head has turned away, but stands still while
 * the user looks for it.
 */
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
