import { MathUtils, Quaternion, Vector3 } from "three";
import { describe, expect, it } from "vitest";
import { sampleManifest } from "../../test/support/fixture/manifest";
import type { HandPose, SpecimenPose } from "../math/grab";
import { XR_DISTANCE_M } from "../render/placement";
import { Specimen } from "../render/specimen_pose";
import type { Command } from "../state/commands";
import { advanceFocus, FAR_AWAY } from "../state/focus_tiles";
import { START_VOLUMES } from "../state/parameters/volumes";
import {
  moveByCommand,
  moveByFingers,
  moveByHead,
  moveByHolders,
  moveByStick,
} from "./hold_specimen";

const START: SpecimenPose = {
  position: new Vector3(0, 0, -1.5),
  orientation: new Quaternion(),
  scale: 1,
};
const hand = (x: number, y: number, z: number): HandPose => ({
  position: new Vector3(x, y, z),
  orientation: new Quaternion(),
});

describe("hands that hold", () => {
  it("carry the specimen by exactly their motion", () => {
    const before = new Map([["right", hand(0.2, 0, -0.3)]]);
    const after = new Map([["right", hand(0.3, 0.05, -0.5)]]);
    const { position, scale } = moveByHolders(START, before, after);
    expect(position.distanceTo(new Vector3(0.1, 0.05, -1.7))).toBeLessThan(1e-12);
    expect(scale).toBe(1);
  });

  it("scale the specimen by the ratio of their distances", () => {
    const before = new Map([
      ["l", hand(-0.1, 0, -0.3)],
      ["r", hand(0.1, 0, -0.3)],
    ]);
    const after = new Map([
      ["l", hand(-0.2, 0, -0.3)],
      ["r", hand(0.2, 0, -0.3)],
    ]);
    expect(moveByHolders(START, before, after).scale).toBeCloseTo(2, 12);
  });

  it("move nothing in their first frame, nor while tracking is lost", () => {
    const here = new Map([["right", hand(0, 0, 0)]]);
    expect(moveByHolders(START, new Map(), here)).toBe(START);
    expect(moveByHolders(START, new Map([["right", null]]), here)).toBe(START);
    expect(moveByHolders(START, here, new Map([["right", null]]))).toBe(START);
  });
});

describe("a stick", () => {
  it("zooms about the given point", () => {
    const pivot = new Vector3(0, 0, -1);
    const { position, scale } = moveByStick(START, { x: 0, y: -1 }, pivot, 1);
    expect(scale).toBeCloseTo(2.5, 12);
    expect(position.z).toBeCloseTo(-1 - 0.5 * 2.5, 12);
  });

  it("turns about the vertical by 90 degrees a second", () => {
    const { orientation, position } = moveByStick(START, { x: 1, y: 0 }, START.position, 1);
    expect(orientation.angleTo(new Quaternion())).toBeCloseTo(Math.PI / 2, 12);
    expect(position.distanceTo(START.position)).toBeLessThan(1e-12);
    expect(moveByStick(START, { x: 0, y: 0 }, START.position, 1)).toBe(START);
  });
});

describe("a command", () => {
  const pivot = new Vector3(0.2, 0, -1.4);
  const eye = new Vector3(0.2, 0, 0);
  const toViewer = new Vector3(0, 0, 1);
  const turned = (axis: Vector3, pose: SpecimenPose | null) =>
    axis.clone().applyQuaternion(pose?.orientation ?? new Quaternion());
  const moved = (command: Command, from = eye, share = 1) => {
    const pose = moveByCommand(START, command, pivot, from, share);
    if (pose === null) throw new Error(`${command} moves nothing`);
    return pose.position.clone().sub(START.position);
  };

  it("turns the named side to the user, from any pose", () => {
    const tilted = moveByStick(START, { x: 0.7, y: 0 }, pivot, 1);
    for (const [command, axis] of [
      ["front", new Vector3(0, 0, 1)],
      ["side", new Vector3(1, 0, 0)],
      ["top", new Vector3(0, 1, 0)],
    ] as const) {
      const pose = moveByCommand(tilted, command, pivot, eye);
      expect(turned(axis, pose).distanceTo(toViewer)).toBeLessThan(1e-12);
      expect(pose?.position.distanceTo(pivot)).toBeCloseTo(START.position.distanceTo(pivot), 12);
    }
  });

  it("moves the specimen nearer without scaling, turns it by a step, or is not handled", () => {
    expect(moveByCommand(START, "zoom-in", pivot, eye)?.scale).toBe(1);
    expect(moved("zoom-in").distanceTo(new Vector3(0, 0, 0.2 * 1.4))).toBeLessThan(1e-12);
    expect(moved("zoom-out").distanceTo(new Vector3(0, 0, -0.25 * 1.4))).toBeLessThan(1e-12);
    const left = moveByCommand(START, "turn-left", pivot, eye);
    expect(left?.orientation.angleTo(new Quaternion())).toBeCloseTo(Math.PI / 12, 12);
    expect(turned(new Vector3(0, 0, 1), left).x).toBeGreaterThan(0);
    expect(moved("pan-left").toArray()).toEqual([0.1, 0, 0]); // as if the user moved to the left
    expect(moveByCommand(START, "share", pivot, eye)).toBeNull();
  });

  it("keeps the specimen between the nearest and the farthest distance when repeated", () => {
    const from = (distance: number): SpecimenPose => ({
      ...START,
      position: pivot.clone().setZ(-distance),
    });
    const repeat = (pose: SpecimenPose, command: Command) => {
      let next = pose;
      for (let i = 0; i < 200; i++) {
        next = moveByCommand(next, command, next.position, eye, 0.3) ?? next;
      }
      return next.position.distanceTo(eye);
    };
    expect(repeat(from(1.4), "zoom-in")).toBeCloseTo(0.1, 9);
    expect(repeat(from(1.4), "zoom-out")).toBeCloseTo(5, 9);
    expect(repeat(from(0.04), "zoom-in")).toBeCloseTo(0.04, 9); // where hands put it: no jump
    const there = moveByCommand(from(0), "zoom-in", eye, eye);
    expect(there?.position.toArray().every(Number.isFinite)).toBe(true);
  });

  it("moves as far by parts of a step as by whole steps", () => {
    const parts = (command: Command) => {
      let next = START;
      for (let i = 0; i < 10; i++) {
        const middle = next.position.clone().add(pivot).sub(START.position);
        next = moveByCommand(next, command, middle, eye, 0.1) ?? next;
      }
      return next.position.clone().sub(START.position);
    };
    // a sideways shift in parts curves around the eye, so it is left out here
    for (const command of ["zoom-in", "zoom-out", "pan-up"] as const) {
      expect(parts(command).distanceTo(moved(command)), command).toBeLessThan(1e-9);
    }
  });

  it("uses left and right as seen from the eye", () => {
    const fromTheLeft = new Vector3(-1.2, 0.3, -1.4); // the eye looks along x
    expect(moved("pan-left", fromTheLeft).distanceTo(new Vector3(0, 0, 0.1))).toBeLessThan(1e-12);
    const up = moveByCommand(START, "turn-up", pivot, fromTheLeft);
    const axis = new Vector3(0, 0, 1); // the eye's right
    expect(turned(axis, up).distanceTo(axis)).toBeLessThan(1e-12);
  });
});

describe("fingers on the split screen", () => {
  const pivot = START.position;
  const eye = new Vector3();

  it("turn the front of the specimen along with them, about its middle", () => {
    const right = moveByFingers(START, { kind: "drag", x: 0.25, y: 0 }, pivot, eye);
    const front = new Vector3(0, 0, 1).applyQuaternion(right.orientation);
    expect(front.x).toBeCloseTo(Math.SQRT1_2, 12); // a quarter of the height is 45 degrees
    const down = moveByFingers(START, { kind: "drag", x: 0, y: 0.25 }, pivot, eye);
    expect(new Vector3(0, 0, 1).applyQuaternion(down.orientation).y).toBeCloseTo(-Math.SQRT1_2, 12);
    expect(right.position.distanceTo(START.position)).toBeLessThan(1e-12);
  });

  it("bring the specimen nearer by pinching out, and shift it with their midpoint", () => {
    const near = moveByFingers(START, { kind: "pinch", factor: 2, x: 0, y: 0 }, pivot, eye);
    expect(near.position.distanceTo(new Vector3(0, 0, -0.75))).toBeLessThan(1e-12);
    expect(near.scale).toBe(1);
    const aside = moveByFingers(START, { kind: "pinch", factor: 1, x: 0.1, y: 0.2 }, pivot, eye);
    const { x, y } = aside.position;
    expect(x).toBeCloseTo(0.1 * 2 * 1.5 * Math.tan((40 * Math.PI) / 180), 12);
    expect(y).toBeCloseTo(-2 * x, 12);
  });

  it("do not move the specimen by a tap", () => {
    expect(moveByFingers(START, { kind: "tap" }, pivot, eye)).toBe(START);
  });
});

describe("moving towards the specimen", () => {
  it("crosses the volume distance: surfaces from afar, volumes when near", () => {
    const { specimen: about, tiles } = sampleManifest(1);
    const specimen = new Specimen(about.bounds_um);
    specimen.anchorAt(new Vector3(0, 0, -XR_DISTANCE_M));
    const eye = new Vector3();
    const near = () => {
      const { matrixWorld } = specimen.group;
      const origin = eye.clone().applyMatrix4(matrixWorld.clone().invert());
      return advanceFocus(FAR_AWAY, {
        gaze: { origin: origin.toArray(), direction: [0, 0, -1] },
        tiles,
        clip: { box: null, plane: null },
        switchDistance_um: START_VOLUMES.switchDistance_m / matrixWorld.getMaxScaleOnAxis(),
        discRadius_rad: 0.2,
        dt_s: 0.1,
      }).near.size;
    };
    const go = (command: Command) => {
      const pose = moveByCommand(specimen.pose, command, specimen.pose.position, eye);
      if (pose !== null) specimen.moveTo(pose, eye);
    };
    expect(near()).toBeGreaterThan(0);
    for (let i = 0; i < 3; i++) go("zoom-out");
    expect(near()).toBe(0);
    for (let i = 0; i < 5; i++) go("zoom-in");
    expect(near()).toBe(tiles.length);
  });
});

describe("a head that holds the specimen by the button", () => {
  const EYE = new Vector3(0, 1.6, 0);
  const gaze = (yaw_deg: number, pitch_deg: number, origin = EYE) => ({
    origin,
    direction: new Vector3(0, 0, -1)
      .applyAxisAngle(new Vector3(1, 0, 0), MathUtils.degToRad(pitch_deg))
      .applyAxisAngle(new Vector3(0, 1, 0), MathUtils.degToRad(yaw_deg)),
  });
  const pivot = new Vector3(0, 1.6, -2);
  const pose = { position: pivot.clone(), orientation: new Quaternion(), scale: 1 };
  const hold = { pose, pivot, gaze: gaze(0, 0) };

  it("carries the specimen around the eye, with the same side facing it", () => {
    const { position, orientation, scale } = moveByHead(hold, gaze(90, 0));
    expect(position.toArray().map((v) => Number(v.toFixed(6)) + 0)).toEqual([-2, 1.6, 0]);
    const front = new Vector3(0, 0, 1).applyQuaternion(orientation);
    expect(front.x).toBeCloseTo(1);
    expect(scale).toBe(1);
  });

  it("brings the specimen nearer when tilted down and farther when tilted up, within limits", () => {
    const away = (pitch_deg: number) =>
      moveByHead(hold, gaze(0, pitch_deg)).position.distanceTo(EYE);
    expect(away(-12)).toBeCloseTo(1);
    expect(away(-24)).toBeCloseTo(0.5);
    expect(away(12)).toBeCloseTo(4);
    expect(away(80)).toBeCloseTo(5);
    expect(away(-80)).toBeCloseTo(0.1);
  });

  it("starts to hold without a jump", () => {
    const held = { ...hold, gaze: gaze(30, -20) };
    expect(moveByHead(held, gaze(30, -20)).position.distanceTo(pivot)).toBeLessThan(1e-9);
  });
});
