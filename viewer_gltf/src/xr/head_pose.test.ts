import { Matrix4, Vector3 } from "three";
import { describe, expect, it } from "vitest";
import { betweenEyes } from "./head_pose";

const eye = (x: number, yaw: number) => ({
  matrixWorld: new Matrix4().makeRotationY(yaw).setPosition(x, 1.6, 0.1),
});

describe("the head", () => {
  it("is between the eyes and looks in the mean direction of both", () => {
    const head = betweenEyes([eye(-0.03, 0.1), eye(0.034, -0.1)]);
    const at = new Vector3().setFromMatrixPosition(head);
    expect(at.distanceTo(new Vector3(0.002, 1.6, 0.1))).toBeLessThan(1e-12);
    const ahead = new Vector3(0, 0, -1).transformDirection(head);
    expect(ahead.distanceTo(new Vector3(0, 0, -1))).toBeLessThan(1e-9);
  });

  it("is the pose of the eye if there is only one", () => {
    const only = eye(0.1, 0.7);
    expect(betweenEyes([only]).equals(only.matrixWorld)).toBe(true);
  });
});
