/**
 * The pose of the head, from the phone's `deviceorientation` events and the angle of its screen.
 * The phone reports turns but no motion. A model of the neck adds the most noticeable motion: the
 * eyes move when the head turns.
 *
 * The angles are those of the W3C's DeviceOrientation Event: intrinsic turns about z, x' and y''.
 * They take the earth's axes to the phone's axes. The earth's axes are x east, y north, z up. The
 * phone's are x to the right of its upright screen, y to its top, z out of it. The scene has y up,
 * so north becomes -z.
 */
import { Matrix4, Quaternion, Vector3 } from "three";

/** Angles in degrees, as in the event. */
export type Reading = Readonly<{ alpha_deg: number; beta_deg: number; gamma_deg: number }>;

/** The compass direction that counts as ahead in the scene, as a turn about the vertical. */
export type Heading = Readonly<{
  yaw_rad: number;
  /** True if the direction is fixed; false while it follows the phone. */
  isHeld: boolean;
  /**
   * The orientation at which the phone has rested, level and in landscape, and since when; null
   * while it moves.
   */
  rest: Readonly<{ head: Quaternion; since_ms: number }> | null;
}>;
export const FREE_HEADING: Heading = { yaw_rad: 0, isHeld: false, rest: null };

/** Milliseconds that a phone must rest before it counts as held before the eyes. */
export const REST_MS = 500;
/** Radians. A phone that turns less than this is at rest; a head trembles by a quarter of it. */
const REST_RAD = (2 * Math.PI) / 180;

const X = new Vector3(1, 0, 0);
const Y = new Vector3(0, 1, 0);
const Z = new Vector3(0, 0, 1);
/**
 * From the neck's pivot to the point between the eyes, metres: the mean of adults in Google's SDK.
 */
const NECK_TO_EYES_M = new Vector3(0, 0.075, -0.08);
/**
 * Vertical part of the view direction above which the phone faces the floor or the ceiling, so that
 * it lies in a hand and not in a viewer.
 */
const STEEP = Math.SQRT1_2;

const turn = new Quaternion();
const vector = new Vector3();
const unit = new Vector3();

/**
 * Returns the orientation of the camera.
 * @param screen_deg `screen.orientation.angle`; 0 is portrait
 */
export function toQuaternion(
  { alpha_deg, beta_deg, gamma_deg }: Reading,
  screen_deg: number,
  out = new Quaternion(),
): Quaternion {
  const rad = Math.PI / 180;
  out.setFromAxisAngle(X, -Math.PI / 2); // from the earth's axes to the scene's
  out.multiply(turn.setFromAxisAngle(Z, alpha_deg * rad));
  out.multiply(turn.setFromAxisAngle(X, beta_deg * rad));
  out.multiply(turn.setFromAxisAngle(Y, gamma_deg * rad));
  return out.multiply(turn.setFromAxisAngle(Z, -screen_deg * rad));
}

/**
 * Updates the direction that counts as ahead.
 * The direction is fixed once the phone has rested for half a second, about level and in landscape:
 * then it is in the viewer, before the eyes. Until then it follows the phone, because users tap the
 * button with the phone in a hand and then lift it to their eyes.
 */
export function followHeading(
  heading: Heading,
  head: Quaternion,
  isLandscape: boolean,
  time_ms: number,
): Heading {
  if (heading.isHeld) return heading;
  const ahead = vector.set(0, 0, -1).applyQuaternion(head);
  const isLevel = Math.abs(ahead.y) < STEEP;
  // If the phone lies on a table with its screen up, ahead is where the screen's upper edge points.
  if (!isLevel) ahead.set(0, ahead.y < 0 ? 1 : -1, 0).applyQuaternion(head);
  const yaw_rad = Math.atan2(-ahead.x, -ahead.z);
  if (!isLevel || !isLandscape) return { yaw_rad, isHeld: false, rest: null };
  const { rest } = heading;
  const isAtRest = rest !== null && rest.head.angleTo(head) < REST_RAD;
  const next = isAtRest ? rest : { head: head.clone(), since_ms: time_ms };
  return { yaw_rad, isHeld: time_ms - next.since_ms >= REST_MS, rest: next };
}

/**
 * Returns the pose of the head in the scene, metres: at the origin, looking along -z, if the eyes
 * look ahead.
 */
export function headPose(head: Quaternion, heading: Heading, out = new Matrix4()): Matrix4 {
  turn.setFromAxisAngle(Y, -heading.yaw_rad).multiply(head);
  vector.copy(NECK_TO_EYES_M).applyQuaternion(turn).sub(NECK_TO_EYES_M);
  return out.compose(vector, turn, unit.setScalar(1));
}

/** Orientation of the head at a time in milliseconds. */
export type HeadTurn = Readonly<{ head: Quaternion; time_ms: number }>;

/**
 * Milliseconds. Range of intervals between two reports from which a speed is computed: shorter
 * intervals give noise, and longer ones an outdated speed.
 */
const REPORTS_MS = [4, 100] as const;
/**
 * Radians per millisecond. A head does not turn faster than this, so a faster report is a jump of
 * the sensor.
 */
const FASTEST = (600 * Math.PI) / 180 / 1000;
/** Milliseconds. A turn is predicted at most this far. */
const MAX_AHEAD_MS = 50;

/**
 * Predicts the orientation of the head `ahead_ms` after the last report, at the speed of the last
 * two reports.
 */
export function predictTurn(
  before: HeadTurn | null,
  last: HeadTurn,
  ahead_ms: number,
  out = new Quaternion(),
): Quaternion {
  out.copy(last.head);
  // a phone that lies still may report nothing more
  if (before === null || ahead_ms > REPORTS_MS[1]) return out;
  const between_ms = last.time_ms - before.time_ms;
  if (between_ms < REPORTS_MS[0] || between_ms > REPORTS_MS[1]) return out;
  const angle = before.head.angleTo(last.head);
  if (angle === 0 || angle / between_ms > FASTEST) return out;
  const share = Math.min(MAX_AHEAD_MS, Math.max(0, ahead_ms)) / between_ms;
  // slerp extrapolates at the same speed beyond 1
  return out.slerpQuaternions(before.head, last.head, 1 + share);
}

export const ORIENTATION_REFUSED =
  "The browser was not allowed to read how the phone is turned, so the view can't follow your " +
  "head. Close this tab, open the page again, and allow motion and orientation when asked.";
export const ORIENTATION_ABSENT =
  "This device does not report how it is turned, so the view can't follow your head.";

/** Reads the phone's orientation, and keeps the direction that counts as ahead. */
export class HeadSensor {
  private reading: Reading | null = null;
  private before: HeadTurn | null = null;
  private last: HeadTurn | null = null;
  /**
   * Angle of the screen at the last report. After the screen rotates, the reading must be converted
   * again.
   */
  private screen_deg = 0;
  private heading = FREE_HEADING;
  private readonly head = new Quaternion();
  private readonly stopped = new AbortController();

  constructor() {
    addEventListener(
      "deviceorientation",
      ({ alpha, beta, gamma, timeStamp }) => {
        // A device without sensors sends one event without values.
        if (alpha === null || beta === null || gamma === null) return;
        this.reading = { alpha_deg: alpha, beta_deg: beta, gamma_deg: gamma };
        this.addReading(timeStamp);
      },
      { signal: this.stopped.signal },
    );
  }

  /**
   * Makes the direction in which the phone points now the direction ahead; if the phone is not
   * level and in landscape, the direction in which it next rests.
   */
  recentre(): void {
    const rest = { head: this.head.clone(), since_ms: Number.NEGATIVE_INFINITY };
    this.heading = { ...FREE_HEADING, rest };
  }

  /**
   * Writes the pose of the head; the identity before the first report.
   *
   * @param at_ms time at which the frame will be seen; the turn is predicted until then
   */
  pose(out: Matrix4, at_ms = 0): Matrix4 {
    if (this.reading === null || this.last === null) return out.identity();
    if (this.screen_deg !== screenAngle_deg()) {
      this.last = null;
      this.addReading(0);
    }
    if (this.last === null) return out.identity();
    predictTurn(this.before, this.last, at_ms - this.last.time_ms, this.head);
    this.heading = followHeading(this.heading, this.head, innerWidth > innerHeight, at_ms);
    return headPose(this.head, this.heading, out);
  }

  private addReading(time_ms: number): void {
    if (this.reading === null) return;
    this.screen_deg = screenAngle_deg();
    this.before = this.last;
    this.last = { head: toQuaternion(this.reading, this.screen_deg), time_ms };
  }

  dispose(): void {
    this.stopped.abort();
  }
}

function screenAngle_deg(): number {
  // Safari before 16.4 has only the older property, with the same sign.
  const old = (window as { orientation?: number }).orientation ?? 0;
  return (screen.orientation as ScreenOrientation | undefined)?.angle ?? old;
}
