import { Euler, Quaternion, Vector3 } from "three";
import { describe, expect, it } from "vitest";
import {
  type HandPose,
  type Hands,
  LARGEST_SCALE,
  limitPlacement,
  moveByOneHand,
  moveByTwoHands,
  poseMatrix,
  SMALLEST_SCALE,
  type SpecimenPose,
  zoomAbout,
} from "./grab";

const X = new Vector3(1, 0, 0);
const Y = new Vector3(0, 1, 0);
const QUARTER = Math.PI / 2;

function turn(axis: Vector3, angle: number): Quaternion {
  return new Quaternion().setFromAxisAngle(axis, angle);
}

function hand(x: number, y: number, z: number, orientation = new Quaternion()): HandPose {
  return { position: new Vector3(x, y, z), orientation };
}

const START: SpecimenPose = {
  position: new Vector3(0.3, 1.2, -1.5),
  orientation: new Quaternion().setFromEuler(new Euler(0.2, -0.5, 0.1)),
  scale: 1.5,
};

/** Where a point of the specimen, in its own space, is in the scene. */
function at(pose: SpecimenPose, x: number, y: number, z: number): Vector3 {
  return new Vector3(x, y, z).applyMatrix4(poseMatrix(pose));
}

function expectNear(found: Vector3, expected: Vector3): void {
  expect(found.distanceTo(expected)).toBeLessThan(1e-9);
}

/** The point of the specimen at a place of the scene. */
function grabbed(pose: SpecimenPose, place: Vector3): Vector3 {
  return place.clone().applyMatrix4(poseMatrix(pose).invert());
}

describe("one hand", () => {
  it("keeps the held point in place in the hand", () => {
    const before = hand(0.1, 1, -0.4, new Quaternion().setFromEuler(new Euler(0.3, 0.1, -0.7)));
    const after = hand(-0.2, 1.3, -0.6, new Quaternion().setFromEuler(new Euler(-1, 0.4, 2)));
    const moved = moveByOneHand(START, before, after);
    const inHand = (pose: SpecimenPose, { position, orientation }: HandPose) =>
      at(pose, 0.2, -0.3, 0.5).sub(position).applyQuaternion(orientation.clone().invert());
    expectNear(inHand(moved, after), inHand(START, before));
    expect(moved.scale).toBe(START.scale);
  });

  it("changes nothing while it does not move", () => {
    const still = hand(1, 2, 3, turn(Y, 1));
    const moved = moveByOneHand(START, still, still);
    expectNear(at(moved, 1, 1, 1), at(START, 1, 1, 1));
  });
});

describe("two hands", () => {
  const before: Hands = [hand(-0.2, 1, -0.5), hand(0.2, 1.1, -0.4)];

  it("keep the two held points in the hands", () => {
    const after: Hands = [hand(-0.5, 1.4, -0.3), hand(0.1, 0.8, -0.9)];
    const moved = moveByTwoHands(START, before, after);
    for (const i of [0, 1]) {
      const point = grabbed(START, before[i].position);
      expectNear(at(moved, point.x, point.y, point.z), after[i].position);
    }
    const length = ([l, r]: Hands) => l.position.distanceTo(r.position);
    expect(moved.scale / START.scale).toBeCloseTo(length(after) / length(before), 12);
  });

  it("turn the specimen about the line between them when both roll", () => {
    const level: Hands = [hand(-0.2, 1, -0.5), hand(0.2, 1, -0.5)];
    const rolled: Hands = [
      hand(-0.2, 1, -0.5, turn(X, 0.6)),
      hand(0.2, 1, -0.5, turn(X, 1)), // the mean of both is 0.8
    ];
    const moved = moveByTwoHands(START, level, rolled);
    const expected = turn(X, 0.8).multiply(START.orientation);
    expect(moved.orientation.angleTo(expected)).toBeLessThan(1e-7);
  });

  it("turn the specimen like a wheel when they circle each other, in any orientation", () => {
    const level: Hands = [hand(-0.2, 1, 0, turn(Y, 0.3)), hand(0.2, 1, 0, turn(X, 0.4))];
    const wheel = turn(Y, QUARTER);
    const round: Hands = [
      hand(0, 1, 0.2, wheel.clone().multiply(level[0].orientation)),
      hand(0, 1, -0.2, wheel.clone().multiply(level[1].orientation)),
    ];
    const moved = moveByTwoHands(START, level, round);
    expect(moved.orientation.angleTo(wheel.clone().multiply(START.orientation))).toBeLessThan(1e-7);
    expect(moved.scale).toBeCloseTo(START.scale);
  });

  it("do not turn or stretch the specimen when they begin in one place", () => {
    const together: Hands = [hand(0, 1, 0), hand(0.001, 1, 0)];
    const moved = moveByTwoHands(START, together, [hand(0, 1.5, 0), hand(0.4, 1.5, 0)]);
    expect(moved.scale).toBe(START.scale);
    expect(moved.orientation.angleTo(START.orientation)).toBeLessThan(1e-7);
  });

  it("do not push the specimen away when it cannot grow further", () => {
    const large = { ...START, scale: LARGEST_SCALE };
    const wide: Hands = [hand(-2, 1, -0.45), hand(2, 1, -0.45)];
    const narrow: Hands = [hand(-0.2, 1, -0.45), hand(0.2, 1, -0.45)];
    const moved = moveByTwoHands(large, narrow, wide);
    expect(moved.scale).toBe(LARGEST_SCALE);
    expectNear(moved.position, large.position);
  });
});

describe("zoom", () => {
  it("keeps the point under the gaze in place", () => {
    const pivot = new Vector3(0.5, 1.4, -1);
    const point = grabbed(START, pivot);
    const zoomed = zoomAbout(START, pivot, 2.5);
    expectNear(at(zoomed, point.x, point.y, point.z), pivot);
    expect(zoomed.scale).toBe(2.5 * START.scale);
    const back = zoomAbout(zoomed, pivot, 1 / 2.5);
    expectNear(at(back, 1, 2, 3), at(START, 1, 2, 3));
  });

  it("ends at the limits without drifting", () => {
    const pivot = new Vector3(0, 0, 0);
    let pose = START;
    for (let i = 0; i < 200; i++) pose = zoomAbout(pose, pivot, 1.1);
    expect(pose.scale).toBe(LARGEST_SCALE);
    expect(zoomAbout(pose, pivot, 3).position.equals(pose.position)).toBe(true);
    for (let i = 0; i < 200; i++) pose = zoomAbout(pose, pivot, 0.9);
    expect(pose.scale).toBe(SMALLEST_SCALE);
  });
});

describe("the specimen stays near the user", () => {
  const viewer = new Vector3(0, 1.6, 0);

  it("even if it is thrown far away", () => {
    const thrown = { ...START, position: new Vector3(30, 1.6, 40), scale: 1e6 };
    const kept = limitPlacement(thrown, viewer, 5, START);
    expectNear(kept.position, new Vector3(3, 1.6, 4));
    expect(kept.scale).toBe(50);
    expect(limitPlacement({ ...START, scale: 0 }, viewer, 5, START).scale).toBe(0.05);
  });

  it("and is not moved if it is already near", () => {
    expect(limitPlacement(START, viewer, 5, START)).toBe(START);
  });

  it("even if a controller's pose is NaN", () => {
    const broken = moveByOneHand(START, hand(0, 0, 0), hand(Number.NaN, 0, 0));
    expect(limitPlacement(broken, viewer, 5, START)).toBe(START);
  });
});
