/** Where in the room the panel and its button are, as directions from the eye. Radians. Pure. */
import { type Matrix4, Vector3 } from "three";

/** From the eye: to the right of -z, and up. */
export type Bearing = Readonly<{ yaw: number; pitch: number }>;
/** The angles that the specimen covers, as seen from the eye; yaw about that of the head. */
export type Extent = Readonly<{
  yaw: readonly [number, number];
  pitch: readonly [number, number];
}>;

const DEG = Math.PI / 180;
/** Gap between specimen and panel, radians. */
const GAP = 3 * DEG;
/** Farthest directions of the panel, radians, down and sideways: heads turn no further for it. */
const LOWEST = -35 * DEG;
const FARTHEST = 62 * DEG;
/** Pitch of the panel, radians: the user looks down on it a little, as on a page. */
const COMFORT = -15 * DEG;
/**
 * Pitch of the button, radians: as far below a level gaze as eyes and neck go without thinking. While
 * the panel is open it hangs under that, which may be straight below the specimen.
 */
const OPENER_PITCH = -30 * DEG;
/** The same below a panel, or below a specimen on a table. */
const OPENER_PITCH_LOW = -52 * DEG;
/** The head turns this far, radians, before the button follows. */
const SLACK = 35 * DEG;
/** Pitch of the head, radians: a user who looks down further looks for the button, so it waits. */
const LOOKING_DOWN = -20 * DEG;
const FOLLOW_PER_S = 4;

/** From the gaze down to a notice's middle, radians: the notice covers nothing of interest. */
const NOTICE_BELOW = 20 * DEG;
/** Lowest pitch of a notice, radians: a user who looks at the floor reads it there. */
const NOTICE_LOWEST = -60 * DEG;

export function noticeBearing({ yaw, pitch }: Bearing): Bearing {
  return { yaw, pitch: Math.max(pitch - NOTICE_BELOW, Math.min(pitch, NOTICE_LOWEST)) };
}

export function openerPitch(isLow: boolean): number {
  return isLow ? OPENER_PITCH_LOW : OPENER_PITCH;
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

/** Corners alone would miss what an edge that passes close to the eye covers. */
export function extentOf(points: readonly Vector3[], eye: Vector3, headYaw: number): Extent {
  const bearings = points.map((point) => bearingOf(point.clone().sub(eye)));
  const yaws = bearings.map(({ yaw }) => wrapped(yaw - headYaw));
  const pitches = bearings.map(({ pitch }) => pitch);
  return {
    yaw: [Math.min(...yaws), Math.max(...yaws)],
    pitch: [Math.min(...pitches), Math.max(...pitches)],
  };
}

/** Where the panel's middle goes, yaw about that of the head; `half`: of what the panel covers. */
export function placePanel({ yaw, pitch }: Extent, half: Bearing): Bearing {
  const middle = Math.min(0.5, Math.max(-0.5, (yaw[0] + yaw[1]) / 2));
  const below: Bearing = {
    yaw: middle,
    pitch: Math.min(pitch[0] - GAP - half.pitch, COMFORT),
  };
  if (below.pitch >= LOWEST) return below;
  const level = Math.min(0, Math.max(COMFORT, (pitch[0] + pitch[1]) / 2));
  const left: Bearing = { yaw: yaw[0] - GAP - half.yaw, pitch: level };
  if (left.yaw >= -FARTHEST) return left;
  const right: Bearing = { yaw: yaw[1] + GAP + half.yaw, pitch: level };
  if (right.yaw <= FARTHEST) return right;
  return { yaw: -FARTHEST, pitch: level }; // the specimen is all around
}

/** The button stays where it is until the head has turned away, and while it is looked for. */
export function followHead(yaw: number, head: Bearing, dt_s: number): number {
  if (head.pitch < LOOKING_DOWN) return yaw;
  const away = wrapped(head.yaw - yaw);
  const over = Math.sign(away) * Math.max(0, Math.abs(away) - SLACK);
  return wrapped(yaw + over * Math.min(1, FOLLOW_PER_S * dt_s));
}
