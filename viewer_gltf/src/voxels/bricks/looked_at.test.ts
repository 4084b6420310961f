import { PerspectiveCamera, Vector3 } from "three";
import { expect, it } from "vitest";
import { type CoarseTile, tilesToSharpen } from "./looked_at";
import type { BrickView } from "./protocol";

/** A cube of 100 um with its centre at x, with texels of 1 um. */
const tile = (id: string, x: number, texel_um = 1): CoarseTile => ({
  id,
  bounds_um: { min: [x - 50, -50, -50], max: [x + 50, 50, 50] },
  texel_um,
});
const ROW = [tile("far left", -300), tile("left", -100), tile("right", 100)];

function look(eye: readonly [number, number, number], target: readonly [number, number, number]) {
  const camera = new PerspectiveCamera(50, 1, 1, 10_000);
  camera.position.set(...eye);
  camera.lookAt(...target);
  camera.updateMatrixWorld();
  const clip = camera.projectionMatrix.clone().multiply(camera.matrixWorldInverse);
  const view: BrickView = {
    clip: clip.toArray(),
    eye,
    gaze: new Vector3(...target).sub(camera.position).normalize().toArray(),
    pixels_per_radian: 1000,
  };
  return view;
}

it("puts the tile in the middle of the view first", () => {
  expect(tilesToSharpen(ROW, look([90, 0, 900], [90, 0, 0]))).toEqual([
    "right",
    "left",
    "far left",
  ]);
  expect(tilesToSharpen(ROW, look([-310, 0, 900], [-310, 0, 0]))[0]).toBe("far left");
});

it("leaves out tiles outside the view and behind the eye", () => {
  expect(tilesToSharpen(ROW, look([100, 0, 200], [100, 0, 0]))).toEqual(["right"]);
  expect(tilesToSharpen(ROW, look([0, 0, 200], [0, 0, 400]))).toEqual([]);
});

it("includes the tile that contains the eye", () => {
  expect(tilesToSharpen(ROW, look([100, 0, 40], [100, 0, -400]))).toEqual(["right"]);
});

it("leaves out tiles that are fine enough on the screen", () => {
  const view = look([100, 0, 850], [100, 0, 0]); // 800 um from the tile, where a pixel is 0.8 um
  expect(tilesToSharpen([tile("fine", 100, 0.7)], view)).toEqual([]);
  expect(tilesToSharpen([tile("coarse", 100, 0.9)], view)).toEqual(["coarse"]);
});
