import {
  BoxGeometry,
  type Camera,
  Mesh,
  MeshBasicMaterial,
  PerspectiveCamera,
  Scene,
  Vector4,
} from "three";
import { beforeEach, describe, expect, it } from "vitest";
import { BothEyes } from "./both_eyes";
import { Eyes } from "./eyes";

describe("a frame's objects", () => {
  let both: BothEyes;
  let scene: Scene;
  let small: Mesh;
  let large: Mesh;

  beforeEach(() => {
    both = new BothEyes();
    [small, large] = [0, 1].map(() => new Mesh(new BoxGeometry(), new MeshBasicMaterial()));
    scene = new Scene().add(small, large);
    both.drawForEach(large, true);
  });

  function eyesOf(count: number): Eyes {
    const eyes = new Eyes();
    eyes.sync(
      Array.from({ length: count }, (_, i) => [
        new PerspectiveCamera(),
        new Vector4(100 * i, 0, 100, 100),
      ]),
    );
    return eyes;
  }

  /** Returns for each camera of a frame, in the order of drawing, the objects that it draws. */
  function drawnBy(eyes: Eyes): readonly (readonly string[])[] {
    both.prepare(scene, eyes.all.length > 1);
    const all = both.cameraOf(eyes);
    const named = { small, large };
    const sees = (camera: Camera) =>
      Object.entries(named)
        .filter(([, { layers }]) => layers.test(all.layers) && layers.test(camera.layers))
        .map(([name]) => name);
    return all.cameras.map(sees);
  }

  it("are all drawn once for a single eye", () => {
    expect(drawnBy(eyesOf(1))).toEqual([[], ["small", "large"]]);
  });

  it("are drawn in stereo for each eye first, if they are large, and then for both at once", () => {
    expect(drawnBy(eyesOf(2))).toEqual([["large"], ["large"], ["small"]]);
  });

  it("change with the number of eyes, and when an object becomes translucent", () => {
    drawnBy(eyesOf(2));
    expect(drawnBy(eyesOf(1))).toEqual([[], ["small", "large"]]);
    both.drawForEach(large, false);
    expect(drawnBy(eyesOf(2))).toEqual([[], [], ["small", "large"]]);
  });
});
