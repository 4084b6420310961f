import { Quaternion, Vector3 } from "three";
import { describe, expect, it } from "vitest";
import type { HandPose, SpecimenPose } from "../math/grab";
import { moveByCommand, moveByHolders, moveByStick } from "./hold_specimen";

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
  it("carry by exactly their motion", () => {
    const before = new Map([["right", hand(0.2, 0, -0.3)]]);
    const after = new Map([["right", hand(0.3, 0.05, -0.5)]]);
    const { position, scale } = moveByHolders(START, before, after);
    expect(position.distanceTo(new Vector3(0.1, 0.05, -1.7))).toBeLessThan(1e-12);
    expect(scale).toBe(1);
  });

  it("scale by the ratio of their distances", () => {
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

  it("move nothing in the frame in which they take hold, nor while they are lost", () => {
    const here = new Map([["right", hand(0, 0, 0)]]);
    expect(moveByHolders(START, new Map(), here)).toBe(START);
    expect(moveByHolders(START, new Map([["right", null]]), here)).toBe(START);
    expect(moveByHolders(START, here, new Map([["right", null]]))).toBe(START);
  });
});

describe("a stick", () => {
  it("zooms about the point it is given", () => {
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
  const toViewer = new Vector3(0, 0, 1);
  const turned = (axis: Vector3, pose: SpecimenPose | null) =>
    axis.clone().applyQuaternion(pose?.orientation ?? new Quaternion());

  it("brings the side that it names to face the viewer, however it was turned", () => {
    const tilted = moveByStick(START, { x: 0.7, y: 0 }, pivot, 1);
    for (const [command, axis] of [
      ["front", new Vector3(0, 0, 1)],
      ["side", new Vector3(1, 0, 0)],
      ["top", new Vector3(0, 1, 0)],
    ] as const) {
      const pose = moveByCommand(tilted, command, pivot);
      expect(turned(axis, pose).distanceTo(toViewer)).toBeLessThan(1e-12);
      expect(pose?.position.distanceTo(pivot)).toBeCloseTo(START.position.distanceTo(pivot), 12);
    }
  });

  it("zooms about the pivot and turns by a step, or is another's", () => {
    expect(moveByCommand(START, "zoom-in", pivot)?.scale).toBeCloseTo(1.25, 12);
    const left = moveByCommand(START, "turn-left", pivot);
    expect(left?.orientation.angleTo(new Quaternion())).toBeCloseTo(Math.PI / 12, 12);
    expect(turned(new Vector3(0, 0, 1), left).x).toBeGreaterThan(0);
    const aside = moveByCommand(START, "pan-left", pivot)?.position.clone().sub(START.position);
    expect(aside?.toArray()).toEqual([0.1, 0, 0]); // as if the viewer went to the left
    expect(moveByCommand(START, "share", pivot)).toBeNull();
  });
});
