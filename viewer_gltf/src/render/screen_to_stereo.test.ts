import { Euler, PerspectiveCamera, Quaternion, Vector3 } from "three";
import { describe, expect, it } from "vitest";
import { poseMatrix, type SpecimenPose } from "../math/grab";
import { intoStereo, ontoScreen } from "./screen_to_stereo";

const AHEAD = new Vector3(0.1, -0.2, -1.1);
const POSE: SpecimenPose = {
  position: new Vector3(0.2, -0.3, 0.4),
  orientation: new Quaternion().setFromEuler(new Euler(0.4, -1.1, 0.2)),
  scale: 2.5,
};

function camera() {
  const camera = new PerspectiveCamera();
  const target = new Vector3(0.3, 0.1, -0.05);
  camera.position.set(1.5, 0.9, -0.7);
  camera.lookAt(target);
  camera.updateMatrixWorld();
  return { camera, screen: { position: target, orientation: camera.quaternion } };
}

const points = [new Vector3(), new Vector3(0.5, 0, 0), new Vector3(-0.1, 0.3, 0.2)];

describe("the specimen moved between the screen and stereo", () => {
  it("lies in front of the head as in front of the camera, with the camera's target straight ahead", () => {
    const { camera: eye, screen } = camera();
    const inStereo = intoStereo(POSE, screen, AHEAD);
    const toTarget = screen.position.clone().applyMatrix4(eye.matrixWorldInverse);
    for (const point of points) {
      const seen = point
        .clone()
        .applyMatrix4(poseMatrix(POSE))
        .applyMatrix4(eye.matrixWorldInverse);
      const found = point.clone().applyMatrix4(poseMatrix(inStereo));
      // seen from the target in the same direction
      expect(found.sub(AHEAD).distanceTo(seen.sub(toTarget))).toBeCloseTo(0, 9);
    }
  });

  it.each([
    ["there and back", intoStereo, ontoScreen],
    ["back and there", ontoScreen, intoStereo],
  ])("has the same pose again, %s", (_, go, comeBack) => {
    const { screen } = camera();
    const again = comeBack(go(POSE, screen, AHEAD), screen, AHEAD);
    expect(again.scale).toBeCloseTo(POSE.scale, 12);
    for (const point of points) {
      const at = point.clone().applyMatrix4(poseMatrix(again));
      expect(at.distanceTo(point.clone().applyMatrix4(poseMatrix(POSE)))).toBeCloseTo(0, 9);
    }
  });
});
