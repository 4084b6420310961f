/** Where in the room the panel and the bar are, as directions from the eye. Radians. Pure. */
import { type Matrix4, Vector3 } from "three";

/** From the eye: to the right of -z, and up. */
export type Bearing = Readonly<{ yaw: number; pitch: number }>;

const DEG = Math.PI / 180;
/** Distance of the panel and of the bar from the eye, m. */
export const PANEL_DISTANCE_M = 1.2;
/** Pitch of the bar, radians: as far below a level gaze as eyes and neck go without thinking. */
const BELOW = -30 * DEG;
/** Pitch of the panel, radians: it begins just below a level gaze, and the bar hangs under it. */
const PANEL_PITCH = -24 * DEG;
/** Pitch of the panel above and behind a specimen on a table: in front, it would hide the specimen. */
const OVER_TABLE = 6 * DEG;
/** A head that looks steeper, radians, up or down, has no clear heading. */
const STEEP = 75 * DEG;
/** The same below a panel, or below a specimen on a table. */
const BAR_PITCH_LOW = -51 * DEG;
/** The head turns this far, radians, before the bar follows. */
const SLACK = 15 * DEG;
/** Pitch of the head, radians: a user who looks down further looks for the bar, so it waits. */
const LOOKING_DOWN = -20 * DEG;
const FOLLOW_PER_S = 4;

/** From the gaze down to a notice's middle, radians: the notice covers nothing of interest. */
const NOTICE_BELOW = 20 * DEG;
/** Lowest pitch of a notice, radians: a user who looks at the floor reads it there. */
const NOTICE_LOWEST = -60 * DEG;

export function noticeBearing({ yaw, pitch }: Bearing): Bearing {
  return { yaw, pitch: Math.max(pitch - NOTICE_BELOW, Math.min(pitch, NOTICE_LOWEST)) };
}

export function barPitch(isLow: boolean): number {
  return isLow ? BAR_PITCH_LOW : BELOW;
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

/**
 * Where the panel's middle goes: straight below the gaze, whichever way its user has turned; `isOverTable`: just
 * above a level gaze.
 */
export function panelBearing(
  { yaw, pitch }: Bearing,
  barYaw: number,
  isOverTable = false,
): Bearing {
  return {
    yaw: Math.abs(pitch) < STEEP ? yaw : barYaw,
    pitch: isOverTable ? OVER_TABLE : PANEL_PITCH,
  };
}

/** The bar stays where it is until the head has turned away, and while it is looked for. */
export function followHead(yaw: number, head: Bearing, dt_s: number): number {
  if (head.pitch < LOOKING_DOWN) return yaw;
  const away = wrapped(head.yaw - yaw);
  const over = Math.sign(away) * Math.max(0, Math.abs(away) - SLACK);
  return wrapped(yaw + over * Math.min(1, FOLLOW_PER_S * dt_s));
}
