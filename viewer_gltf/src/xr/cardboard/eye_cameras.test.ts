import { Frustum, Matrix4, Vector3 } from "three";
import { describe, expect, it } from "vitest";
import { EyeCameras } from "./eye_cameras";
import { screenOf } from "./lens";
import { CARDBOARD_V1, CARDBOARD_V2 } from "./viewer_profile";

const SCREEN = screenOf(844, 390, 153.3);

function frustumOf(camera: EyeCameras["both"] | EyeCameras["eyes"][number]["camera"]): Frustum {
  const { projectionMatrix, matrixWorldInverse } = camera;
  return new Frustum().setFromProjectionMatrix(
    new Matrix4().multiplyMatrices(projectionMatrix, matrixWorldInverse),
  );
}

describe("the cameras of the two eyes", () => {
  it("are as far apart as the lenses, along the head's x axis", () => {
    const cameras = new EyeCameras();
    cameras.fit(CARDBOARD_V2, SCREEN, 844, 390);
    const turn = new Matrix4().makeRotationY(0.7).setPosition(1, 2, 3);
    cameras.follow(turn);
    const [left, right] = cameras.eyes.map(({ camera }) =>
      new Vector3().setFromMatrixPosition(camera.matrixWorld),
    );
    const across = new Vector3(1, 0, 0).transformDirection(turn);
    expect(right.clone().sub(left).dot(across)).toBeCloseTo(CARDBOARD_V2.interLens_m, 12);
    expect(
      left
        .add(right)
        .divideScalar(2)
        .distanceTo(new Vector3(1, 2, 3)),
    ).toBeCloseTo(0, 12);
  });

  it("have one half of the render target each, also for an odd width", () => {
    const cameras = new EyeCameras();
    cameras.fit(CARDBOARD_V1, SCREEN, 845, 390);
    expect(cameras.eyes.map(({ viewport }) => viewport.toArray())).toEqual([
      [0, 0, 422, 390],
      [422, 0, 422, 390],
    ]);
  });

  it("lie within the frustum that is used for culling", () => {
    const lens = { ...CARDBOARD_V2, fov_deg: { outer: 55, inner: 35, bottom: 40, top: 45 } };
    const cameras = new EyeCameras();
    cameras.fit(lens, SCREEN, 844, 390);
    cameras.follow(new Matrix4().makeRotationX(0.3));
    const both = frustumOf(cameras.both);
    const corner = new Vector3();
    for (const { camera } of cameras.eyes) {
      for (let i = 0; i < 8; i++) {
        corner.set(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1).multiplyScalar(1 - 1e-6);
        corner.unproject(camera);
        for (const plane of both.planes) {
          expect(plane.distanceToPoint(corner)).toBeGreaterThan(-1e-6);
        }
      }
    }
  });
});
