import { PerspectiveCamera, Vector3 } from "three";
import { expect, it } from "vitest";
import { ScreenEyes } from "./screen_eyes";

const [WIDTH, HEIGHT] = [900, 600];
const PUPILS_M = 0.063;

/** A camera of 40 degrees at (0.2, 0.3, `z`) that looks along -z. */
function cameraAt(z: number): PerspectiveCamera {
  const camera = new PerspectiveCamera(40, WIDTH / HEIGHT, 0.01, 20);
  camera.position.set(0.2, 0.3, z);
  camera.updateMatrixWorld();
  return camera;
}

/** Pixels by which a point lies further to the right for the left eye than for the right eye. */
function disparity_px(point: Vector3, z: number, pupils_m = PUPILS_M): number {
  const eyes = new ScreenEyes();
  eyes.sync(cameraAt(z), new Vector3(0.1, 0, 0), pupils_m, [WIDTH, HEIGHT]);
  const [left, right] = eyes.pairs.map(([camera]) => {
    camera.matrixWorldInverse.copy(camera.matrixWorld).invert();
    const seen = point.clone().applyMatrix4(camera.matrixWorldInverse);
    return ((seen.applyMatrix4(camera.projectionMatrix).x + 1) / 2) * WIDTH;
  });
  return left - right;
}

const FOCAL_PX = HEIGHT / 2 / Math.tan((20 * Math.PI) / 180);

it.each([
  [0.5, 1.8],
  [0, 1.8],
  [-0.7, 1.8],
  [0.1, 0.6],
  [-0.2, 3.1],
])("a point at z = %f has the parallax of two eyes at z = %f", (z, camera_z) => {
  // similar triangles: eye distance * (1 / distance - 1 / distance of the plane), in focal lengths
  const apart_m = (PUPILS_M * camera_z) / 1.8;
  const expected = FOCAL_PX * apart_m * (1 / (camera_z - z) - 1 / camera_z);
  expect(disparity_px(new Vector3(0.3, -0.1, z), camera_z)).toBeCloseTo(expected, 6);
});

it("a point has no parallax in the plane through the focus, or if both eyes are in one place", () => {
  expect(disparity_px(new Vector3(-0.4, 0.2, 0), 1.1)).toBeCloseTo(0, 9);
  expect(disparity_px(new Vector3(-0.4, 0.2, 0.4), 1.1, 0)).toBeCloseTo(0, 9);
});

it("the parallax behind the screen stays below a thirtieth of the width", () => {
  expect(-disparity_px(new Vector3(0, 0, -15), 1.8)).toBeLessThan(WIDTH / 30);
});

it("each eye has its half of the render target", () => {
  const eyes = new ScreenEyes();
  eyes.sync(cameraAt(1), new Vector3(), PUPILS_M, [WIDTH, HEIGHT]);
  expect(eyes.pairs.map(([, viewport]) => viewport.toArray())).toEqual([
    [0, 0, WIDTH, HEIGHT],
    [WIDTH, 0, WIDTH, HEIGHT],
  ]);
});
