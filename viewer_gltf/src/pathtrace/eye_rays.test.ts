import { Euler, Matrix4, PerspectiveCamera, Vector3 } from "three";
import { describe, expect, it } from "vitest";
import { areNear, areSame, turnOf, viewOf } from "./eye_rays";

const AWAY = 100;
const MIDDLE = new Vector3(0, 0, 0);

/** An eye in front of the centre, moved by um and turned by degrees (up, left, rolled). */
function eye(aside: readonly number[] = [0, 0, 0], turned_deg: readonly number[] = [0, 0, 0]) {
  const camera = new PerspectiveCamera(50, 1.5, 1, 1000);
  camera.position.set(aside[0], aside[1], AWAY + aside[2]);
  const [x, y, z] = turned_deg.map((v) => (v * Math.PI) / 180);
  camera.setRotationFromEuler(new Euler(x, y, z));
  camera.updateMatrixWorld();
  return camera;
}
const IDENTITY = new Matrix4();
const views = (a: PerspectiveCamera, b: PerspectiveCamera, box: Matrix4) =>
  [a, b].map((camera) => [viewOf(camera, box)]);

describe("a view", () => {
  it("maps points of the frame to the box and back", () => {
    const box = new Matrix4().compose(
      new Vector3(3, -4, 5),
      new PerspectiveCamera().quaternion.setFromEuler(new Euler(0.4, 1, -2)),
      new Vector3(2, 2, 2),
    );
    const camera = eye([5, 3, 2], [4, -3, 9]);
    const view = viewOf(camera, box);
    const inBox = new Vector3(7, 1, -3);
    const inPicture = inBox.clone().applyMatrix4(box).project(camera);
    expect(inBox.clone().applyMatrix4(view.fromBox).distanceTo(inPicture)).toBeLessThan(1e-9);
    expect(inPicture.clone().applyMatrix4(view.toBox).distanceTo(inBox)).toBeLessThan(1e-6);
    expect(view.eye.clone().applyMatrix4(box).distanceTo(camera.position)).toBeLessThan(1e-9);
  });

  it.each([
    ["nothing", [0, 0, 0], [0, 0, 0], true],
    ["hardly anything", [1e-6, 0, 0], [0, 0, 0], true],
    ["a step to the side", [0.5, 0, 0], [0, 0, 0], true],
    ["a large step to the side", [0.7, 0, 0], [0, 0, 0], false],
    ["a step ahead", [0, 0, 0.5], [0, 0, 0], true],
    ["a large step ahead", [0, 0, 3], [0, 0, 0], false],
    ["a nod", [0, 0, 0], [0.25, 0, 0], true],
    ["a large nod", [0, 0, 0], [0.35, 0, 0], false],
    ["a turn", [0, 0, 0], [0, -0.25, 0], true],
    ["a large turn", [0, 0, 0], [0, 0.35, 0], false],
    ["a roll", [0, 0, 0], [0, 0, 0.25], true],
    ["a large roll", [0, 0, 0], [0, 0, 0.4], false],
  ] as const)("is near the one before after %s, or not", (name, aside, turned, expected) => {
    // The result does not depend on size and place of the box.
    for (const box of [IDENTITY, new Matrix4().makeScale(0.01, 0.01, 0.01).setPosition(1, 2, 3)]) {
      const [before, now] = views(eye(), eye(aside, turned), box);
      const middle = MIDDLE.clone().applyMatrix4(box.clone().invert());
      expect(areNear(before, now, middle)).toBe(expected);
      expect(areSame(before, now)).toBe(name === "nothing");
    }
  });

  it("differs between different eyes", () => {
    const one = viewOf(eye(), IDENTITY);
    expect(areNear([one], [one, one], MIDDLE)).toBe(false);
    expect(areSame([], [one])).toBe(false);
    const far = viewOf(eye([5, 0, 0]), IDENTITY);
    expect(areNear([one, one], [one, far], MIDDLE)).toBe(false);
  });

  it("rotates directions without stretching them", () => {
    const box = new Matrix4()
      .makeRotationZ(Math.PI / 2)
      .scale(new Vector3(5, 5, 5))
      .setPosition(9, 9, 9);
    const found = new Vector3(1, 0, 0).applyMatrix3(turnOf(box));
    expect(found.distanceTo(new Vector3(0, 1, 0))).toBeLessThan(1e-9);
  });
});
