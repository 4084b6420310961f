/**
 * The head's turn, from the phone's own reports: `deviceorientation` events and the
 * angle at which the screen is held. Only turning is known, not moving; a neck that the eyes lie
 * before makes up for the most noticed part of that.
 *
 * The angles are those of the W3C's DeviceOrientation Event: intrinsic turns about z, x' and y''
 * that take the earth's axes (x east, y north, z up) to the phone's (x to the right of its upright
 * screen, y to its top, z out of it). The room has y up, so that north becomes -z.
 */
import { Matrix4, Quaternion, Vector3 } from "three";

/** Degrees, as the event has them. */
export type Reading = Readonly<{ alpha_deg: number; beta_deg: number; gamma_deg: number }>;

/** Which way of the earth is ahead in the room, as a turn about the vertical. */
export type Heading = Readonly<{
  yaw_rad: number;
  /** Whether it stays; else it goes along with the phone. */
  isHeld: boolean;
  /** The turn from which the phone has hardly moved, level and across, and since when; null: it moves. */
  rest: Readonly<{ head: Quaternion; since_ms: number }> | null;
}>;
export const FREE_HEADING: Heading = { yaw_rad: 0, isHeld: false, rest: null };

/** Time for which a phone rests that has come to its place before the eyes, ms. */
export const REST_MS = 500;
/** Largest turn of a phone that rests, radians: a head trembles by a quarter of it. */
const REST_RAD = (2 * Math.PI) / 180;

const X = new Vector3(1, 0, 0);
const Y = new Vector3(0, 1, 0);
const Z = new Vector3(0, 0, 1);
/** From the neck's pivot to the point between the eyes, m: mean of adults, as in Google's SDK. */
const NECK_TO_EYES_M = new Vector3(0, 0.075, -0.08);
/** Beyond this the phone looks at floor or ceiling, and lies in a hand rather than in a viewer. */
const STEEP = Math.SQRT1_2;

const turn = new Quaternion();
const vector = new Vector3();
const unit = new Vector3();

/** The camera's turn. @param screen_deg `screen.orientation.angle`; 0 is the phone's upright way */
export function toQuaternion(
  { alpha_deg, beta_deg, gamma_deg }: Reading,
  screen_deg: number,
  out = new Quaternion(),
): Quaternion {
  const rad = Math.PI / 180;
  out.setFromAxisAngle(X, -Math.PI / 2); // the earth's axes to the room's
  out.multiply(turn.setFromAxisAngle(Z, alpha_deg * rad));
  out.multiply(turn.setFromAxisAngle(X, beta_deg * rad));
  out.multiply(turn.setFromAxisAngle(Y, gamma_deg * rad));
  return out.multiply(turn.setFromAxisAngle(Z, -screen_deg * rad));
}

/**
 * Ahead is where the phone looks when it has rested for half a second, about level and across: then it is in the
 * viewer, before the eyes. Until then ahead goes along, since the button is tapped with the phone in a hand, and the
 * hand then lifts phone and viewer to the eyes.
 */
export function followHeading(
  heading: Heading,
  head: Quaternion,
  isAcross: boolean,
  time_ms: number,
): Heading {
  if (heading.isHeld) return heading;
  const ahead = vector.set(0, 0, -1).applyQuaternion(head);
  const isLevel = Math.abs(ahead.y) < STEEP;
  // On a table, the screen up, the way ahead is that of the screen's upper edge.
  if (!isLevel) ahead.set(0, ahead.y < 0 ? 1 : -1, 0).applyQuaternion(head);
  const yaw_rad = Math.atan2(-ahead.x, -ahead.z);
  if (!isLevel || !isAcross) return { yaw_rad, isHeld: false, rest: null };
  const { rest } = heading;
  const isAtRest = rest !== null && rest.head.angleTo(head) < REST_RAD;
  const next = isAtRest ? rest : { head: head.clone(), since_ms: time_ms };
  return { yaw_rad, isHeld: time_ms - next.since_ms >= REST_MS, rest: next };
}

/** The head's pose in the room, metres: the origin is where the eyes are looking ahead, -z. */
export function headPose(head: Quaternion, heading: Heading, out = new Matrix4()): Matrix4 {
  turn.setFromAxisAngle(Y, -heading.yaw_rad).multiply(head);
  vector.copy(NECK_TO_EYES_M).applyQuaternion(turn).sub(NECK_TO_EYES_M);
  return out.compose(vector, turn, unit.setScalar(1));
}

/** A head's turn at a time, ms. */
export type Turned = Readonly<{ head: Quaternion; time_ms: number }>;

/** Between two reports, ms: closer ones have no speed, of farther ones nobody knows what was between. */
const REPORTS_MS = [4, 100] as const;
/** No head turns faster, radians a millisecond: a sensor that jumps does. */
const FASTEST = (600 * Math.PI) / 180 / 1000;
/** Farthest that is predicted, ms. */
const MAX_AHEAD_MS = 50;

/** The head's turn a little later than the last report, as fast as between the last two. */
export function predictTurn(
  before: Turned | null,
  last: Turned,
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
  // slerp goes on beyond its end at the same speed
  return out.slerpQuaternions(before.head, last.head, 1 + share);
}

export const ORIENTATION_REFUSED =
  "This browser was not allowed to tell how the phone is turned, so the picture can't follow your " +
  "head. Close this tab, open the page again, and allow motion and orientation when asked.";
export const ORIENTATION_ABSENT =
  "This device doesn't tell how it is turned: the picture doesn't follow your head.";

/** Listens to the phone, and knows which way is ahead. */
export class HeadSensor {
  private reading: Reading | null = null;
  private before: Turned | null = null;
  private last: Turned | null = null;
  /** Of the screen when they were made: by another they would be other turns. */
  private screen_deg = 0;
  private heading = FREE_HEADING;
  private readonly head = new Quaternion();
  private readonly stopped = new AbortController();

  constructor() {
    addEventListener(
      "deviceorientation",
      ({ alpha, beta, gamma, timeStamp }) => {
        // A device without sensors sends one event of nothing.
        if (alpha === null || beta === null || gamma === null) return;
        this.reading = { alpha_deg: alpha, beta_deg: beta, gamma_deg: gamma };
        this.take(timeStamp);
      },
      { signal: this.stopped.signal },
    );
  }

  /** Ahead is where the phone looks now; if it isn't level and across, where it looks once it has rested so. */
  recentre(): void {
    const rest = { head: this.head.clone(), since_ms: Number.NEGATIVE_INFINITY };
    this.heading = { ...FREE_HEADING, rest };
  }

  /**
   * The head's pose; the identity as long as nothing is known.
   *
   * @param at_ms when the picture will be seen: the head turns on until then
   */
  pose(out: Matrix4, at_ms = 0): Matrix4 {
    if (this.reading === null || this.last === null) return out.identity();
    if (this.screen_deg !== screenAngle_deg()) {
      this.last = null;
      this.take(0);
    }
    if (this.last === null) return out.identity();
    predictTurn(this.before, this.last, at_ms - this.last.time_ms, this.head);
    this.heading = followHeading(this.heading, this.head, innerWidth > innerHeight, at_ms);
    return headPose(this.head, this.heading, out);
  }

  private take(time_ms: number): void {
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
  // Safari before 16.4 has only the old property, with the same sign.
  const old = (window as { orientation?: number }).orientation ?? 0;
  return (screen.orientation as ScreenOrientation | undefined)?.angle ?? old;
}
