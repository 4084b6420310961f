import { Object3D, PerspectiveCamera, Sprite, SpriteMaterial } from "three";
import { describe, expect, it } from "vitest";
import { clearestOf, inCorners, labelBoxes } from "./label_boxes";

const PICTURE = { width: 400, height: 200 };

describe("the place of a label in a picture", () => {
  /** A camera whose view is 2 wide and 1 high at a distance of 1. */
  const camera = new PerspectiveCamera((2 * Math.atan(0.5) * 180) / Math.PI, 2, 0.1, 10);
  camera.updateMatrixWorld(true);
  const root = new Object3D();
  const label = new Sprite(new SpriteMaterial());
  root.add(label);

  it("follows from its point, its size and its distance", () => {
    label.position.set(0.5, 0.25, -1);
    label.scale.set(0.4, 0.1, 1);
    label.center.set(0.5, 0); // the label lies above its point
    const [box] = labelBoxes(root, camera, PICTURE);
    expect(box.x).toBeCloseTo(300 - 40, 6);
    expect(box.width).toBeCloseTo(80, 6);
    expect(box.y).toBeCloseTo(50 - 20, 6);
    expect(box.height).toBeCloseTo(20, 6);
    label.position.multiplyScalar(2);
    expect(labelBoxes(root, camera, PICTURE)[0].width).toBeCloseTo(40, 6);
  });

  it("does not exist if the label is hidden or behind the eye", () => {
    label.position.set(0, 0, 1);
    expect(labelBoxes(root, camera, PICTURE)).toEqual([]);
    label.position.set(0, 0, -1);
    label.visible = false;
    expect(labelBoxes(root, camera, PICTURE)).toEqual([]);
  });
});

describe("a block of a picture", () => {
  const places = inCorners(["top-left", "top-right"], { width: 100, height: 50 }, PICTURE, 10);

  it("stays in its corner if that is clear", () => {
    expect(clearestOf(places, [])).toEqual({ x: 10, y: 10, width: 100, height: 50 });
    const below = [{ x: 10, y: 60, width: 50, height: 50 }];
    expect(clearestOf(places, below).x).toBe(10);
  });

  it("moves to the next corner if a label is in its own", () => {
    const label = { x: 80, y: 40, width: 60, height: 30 };
    expect(clearestOf(places, [label]).x).toBe(290);
    const more = { x: 300, y: 0, width: 100, height: 100 };
    expect(clearestOf(places, [label, more]).x).toBe(10); // this corner overlaps the labels less
  });
});
