import { Euler, Matrix4, PerspectiveCamera, Vector3 } from "three";
import { describe, expect, it } from "vitest";
import { historyOf, turnOf, viewOf } from "./view";

const AWAY = 100;
const MIDDLE = new Vector3(0, 0, 0);

/** An eye before the middle, moved (um) and turned (degrees: up, left, rolled). */
function eye(aside: readonly number[] = [0, 0, 0], turned_deg: readonly number[] = [0, 0, 0]) {
  const camera = new PerspectiveCamera(50, 1.5, 1, 1000);
  camera.position.set(aside[0], aside[1], AWAY + aside[2]);
  const [x, y, z] = turned_deg.map((v) => (v * Math.PI) / 180);
  camera.setRotationFromEuler(new Euler(x, y, z));
  camera.updateMatrixWorld();
  return camera;
}
const IDENTITY = new Matrix4();
const history = (a: PerspectiveCamera, b: PerspectiveCamera, box = IDENTITY) =>
  historyOf(viewOf(a, box), viewOf(b, box), MIDDLE.clone().applyMatrix4(box.clone().invert()));

describe("a view", () => {
  it("leads from the picture to the box and back", () => {
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

  it("has no history at first, all of it while it stays", () => {
    expect(historyOf(undefined, viewOf(eye(), IDENTITY), MIDDLE)).toBe("none");
    expect(history(eye(), eye())).toBe("same");
  });

  it.each([
    ["a step to the side", [0.5, 0, 0], [0, 0, 0], "aside"],
    ["a large step to the side", [0.7, 0, 0], [0, 0, 0], "none"],
    ["a step ahead", [0, 0, 0.5], [0, 0, 0], "aside"],
    ["a large step ahead", [0, 0, 3], [0, 0, 0], "none"],
    ["a nod", [0, 0, 0], [0.25, 0, 0], "aside"],
    ["a large nod", [0, 0, 0], [0.35, 0, 0], "none"],
    ["a turn", [0, 0, 0], [0, -0.25, 0], "aside"],
    ["a large turn", [0, 0, 0], [0, 0.35, 0], "none"],
    ["a roll", [0, 0, 0], [0, 0, 0.25], "aside"],
    ["a large roll", [0, 0, 0], [0, 0, 0.4], "none"],
    ["hardly anything", [1e-6, 0, 0], [0, 0, 0], "aside"],
  ] as const)("after %s", (_, aside, turned, expected) => {
    expect(history(eye(), eye(aside, turned))).toBe(expected);
    // whatever the box's own size and place
    const box = new Matrix4().makeScale(0.01, 0.01, 0.01).setPosition(1, 2, 3);
    expect(history(eye(), eye(aside, turned), box)).toBe(expected);
  });

  it("turns directions without stretching them", () => {
    const box = new Matrix4()
      .makeRotationZ(Math.PI / 2)
      .scale(new Vector3(5, 5, 5))
      .setPosition(9, 9, 9);
    const found = new Vector3(1, 0, 0).applyMatrix3(turnOf(box));
    expect(found.distanceTo(new Vector3(0, 1, 0))).toBeLessThan(1e-9);
  });
});
