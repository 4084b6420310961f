import { Euler, Quaternion, Vector3 } from "three";
import { describe, expect, it } from "vitest";
import {
  FREE_HEADING,
  followHeading,
  headPose,
  predictTurn,
  REST_MS,
  type Reading,
  toQuaternion,
} from "./orientation";

const reading = (alpha_deg: number, beta_deg: number, gamma_deg: number): Reading => ({
  alpha_deg,
  beta_deg,
  gamma_deg,
});
const ahead = (q: Quaternion) => new Vector3(0, 0, -1).applyQuaternion(q).toArray();
const up = (q: Quaternion) => new Vector3(0, 1, 0).applyQuaternion(q).toArray();

function expectVector(found: readonly number[], wanted: readonly number[]): void {
  wanted.forEach((v, i) => {
    expect(found[i]).toBeCloseTo(v, 9);
  });
}

describe("the orientation of the head, read from the phone", () => {
  it("is the identity in landscape, top to the left, upright and facing north", () => {
    const q = toQuaternion(reading(90, 0, -90), 90);
    expectVector(ahead(q), [0, 0, -1]);
    expectVector(up(q), [0, 1, 0]);
  });

  it("is the identity in landscape with the phone's top to the right", () => {
    const q = toQuaternion(reading(270, 0, 90), 270);
    expectVector(ahead(q), [0, 0, -1]);
    expectVector(up(q), [0, 1, 0]);
  });

  it("is the identity in portrait with the screen at 0 degrees", () => {
    const q = toQuaternion(reading(0, 90, 0), 0);
    expectVector(ahead(q), [0, 0, -1]);
    expectVector(up(q), [0, 1, 0]);
  });

  it("faces the floor when the phone lies flat on a table", () => {
    const q = toQuaternion(reading(0, 0, 0), 0);
    expectVector(ahead(q), [0, -1, 0]);
    expectVector(up(q), [0, 0, -1]); // the phone's upper edge points north
  });

  it("turns from north to west when the phone turns left", () => {
    const q = toQuaternion(reading(180, 0, -90), 90);
    expectVector(ahead(q), [-1, 0, 0]);
    expectVector(up(q), [0, 1, 0]);
  });

  it("raises the view when the phone tilts up", () => {
    // In landscape, the screen tilted to the floor by 30 degrees: its back points up.
    const half = Math.sqrt(3) / 2;
    const q = toQuaternion(reading(270, 180, 60), 90);
    expectVector(ahead(q), [0, 0.5, -half]);
    expectVector(up(q), [0, half, 0.5]);
  });

  it("is continuous at the horizon, where the angles jump", () => {
    const below = toQuaternion(reading(90, 0, -89.9), 90);
    const above = toQuaternion(reading(270, 180, 89.9), 90);
    expect((below.angleTo(above) * 180) / Math.PI).toBeCloseTo(0.2, 6);
  });
});

describe("the direction that counts as ahead", () => {
  const turned = (yaw_deg: number) => toQuaternion(reading(90 + yaw_deg, 0, -90), 90);
  /** Heading after the phone has rested for a second. */
  const rested = (head: Quaternion, isLandscape = true, heading = FREE_HEADING) => {
    const first = followHeading(heading, head, isLandscape, 0);
    return followHeading(first, head, isLandscape, 1000);
  };

  it("is fixed where the phone rests for half a second, level and in landscape", () => {
    let heading = followHeading(FREE_HEADING, turned(70), true, 0);
    heading = followHeading(heading, turned(70.5), true, REST_MS - 10); // a head trembles
    expect(heading.isHeld).toBe(false);
    heading = followHeading(heading, turned(70), true, REST_MS);
    expect(heading.isHeld).toBe(true);
    expectVector(headPose(turned(70), heading).toArray(), [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]);
    expect(followHeading(heading, turned(120), true, 9000)).toBe(heading);
    const left = new Vector3(0, 0, -1).transformDirection(headPose(turned(160), heading));
    expectVector(left.toArray(), [-1, 0, 0]);
  });

  it("follows the phone while hands lift it to the eyes, even if it is level on the way", () => {
    let heading = FREE_HEADING;
    for (let time_ms = 0; time_ms <= 1500; time_ms += 20) {
      heading = followHeading(heading, turned(time_ms / 20), true, time_ms);
      expect(heading.isHeld).toBe(false);
      const ahead = new Vector3(0, 0, -1).transformDirection(
        headPose(turned(time_ms / 20), heading),
      );
      expectVector(ahead.toArray(), [0, 0, -1]);
    }
    for (let time_ms = 1520; time_ms <= 2100; time_ms += 20) {
      heading = followHeading(heading, turned(75), true, time_ms);
    }
    expect(heading.isHeld).toBe(true);
    expect((heading.yaw_rad * 180) / Math.PI).toBeCloseTo(75, 9);
  });

  it("follows the phone while it is held in a hand", () => {
    expect(rested(turned(10), false).isHeld).toBe(false);
    const flat = toQuaternion(reading(30, 0, 0), 0);
    const heading = rested(flat);
    expect(heading.isHeld).toBe(false);
    expect((heading.yaw_rad * 180) / Math.PI).toBeCloseTo(30, 9);
  });

  it("changes only the heading, so the horizon stays level", () => {
    const tilted = toQuaternion(reading(270 + 50, 180, 60), 90); // 30 degrees up
    const heading = rested(tilted);
    const pose = new Euler().setFromRotationMatrix(headPose(tilted, heading), "YXZ");
    expect((pose.x * 180) / Math.PI).toBeCloseTo(30, 9);
    expect(pose.y).toBeCloseTo(0, 9);
    expect(pose.z).toBeCloseTo(0, 9);
  });

  it("moves the eyes around the neck when the head turns", () => {
    const heading = rested(turned(0));
    const eyes = new Vector3().setFromMatrixPosition(headPose(turned(90), heading));
    expectVector(eyes.toArray(), [-0.08, 0, 0.08]); // from in front of the neck to left of it
  });
});

describe("the predicted turn of the head", () => {
  const turned = (yaw_deg: number, time_ms: number) => ({
    head: new Quaternion().setFromAxisAngle(new Vector3(0, 1, 0), (yaw_deg * Math.PI) / 180),
    time_ms,
  });
  const yaw_deg = (q: Quaternion) => (2 * Math.atan2(q.y, q.w) * 180) / Math.PI;

  it("continues at the last speed for one frame", () => {
    expect(yaw_deg(predictTurn(turned(10, 0), turned(12, 20), 16))).toBeCloseTo(13.6, 3);
    expect(yaw_deg(predictTurn(turned(12, 0), turned(10, 20), 16))).toBeCloseTo(8.4, 3);
  });

  it("is the last report if no speed can be computed from it", () => {
    const last = turned(12, 20);
    for (const before of [null, turned(12, 4), turned(10, 18), turned(10, -200), turned(-30, 0)]) {
      expect(yaw_deg(predictTurn(before, last, 16))).toBeCloseTo(12, 6);
    }
    expect(yaw_deg(predictTurn(turned(10, 0), last, -5))).toBeCloseTo(12, 6);
  });

  it("continues for at most 50 ms, and returns to the last report if no more reports come", () => {
    expect(yaw_deg(predictTurn(turned(10, 0), turned(12, 20), 90))).toBeCloseTo(17, 1);
    expect(yaw_deg(predictTurn(turned(10, 0), turned(12, 20), 500))).toBeCloseTo(12, 6);
  });
});
