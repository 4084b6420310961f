import { describe, expect, it } from "vitest";
import { dot, type Vec3 } from "../math/vec3";
import {
  hitSlices,
  outlineOf,
  placeIn,
  pointAt,
  pointIn,
  sharesOf,
  sliceFrames,
  turnedBy,
} from "./slice_frame";

const BOX = { min: [0, -20, 10], max: [40, 0, 20] } as const;
const STRAIGHT: Vec3 = [0, 0, 0];
const PATIENT = { left: [1, 0, 0], posterior: [0, 0, -1], superior: [0, 1, 0] } as const;

function expectNear(found: readonly number[], wanted: readonly number[]): void {
  found.forEach((v, i) => {
    expect(v).toBeCloseTo(wanted[i], 9);
  });
}

describe("the slice planes", () => {
  it("go through one point at right angles, at any rotation", () => {
    const point: Vec3 = [10, -5, 12];
    for (const turn_deg of [STRAIGHT, [20, -35, 110]] as const) {
      const frames = sliceFrames({ point, turn_deg }, BOX, null);
      for (const [i, { origin, right, up, normal }] of frames.entries()) {
        expect(dot(normal, point)).toBeCloseTo(dot(normal, origin), 9);
        for (const pair of [dot(right, up), dot(up, normal), dot(normal, right)]) {
          expect(pair).toBeCloseTo(0, 12);
        }
        expect(dot(normal, frames[(i + 1) % 3].normal)).toBeCloseTo(0, 12);
      }
    }
  });

  it("show a patient from the feet, the front and the left, with the letters of radiologists", () => {
    const [axial, coronal, sagittal] = sliceFrames(
      { point: [20, -10, 15], turn_deg: STRAIGHT },
      BOX,
      PATIENT,
    );
    expect([axial, coronal, sagittal].map(({ name, ends }) => [name, ...ends])).toEqual([
      ["axial", "R", "L", "A", "P"],
      ["coronal", "R", "L", "S", "I"],
      ["sagittal", "A", "P", "S", "I"],
    ]);
    // the axial slice is seen from the feet, so its normal, which leads to the eye, points down
    expectNear(axial.normal, [0, -1, 0]);
    expectNear(coronal.normal, [0, 0, 1]);
    expectNear(sagittal.normal, [1, 0, 0]);
  });

  it("name all sides that an oblique slice leads to, the nearest first", () => {
    const [axial] = sliceFrames({ point: [20, -10, 15], turn_deg: [0, 30, 0] }, BOX, PATIENT);
    expect(axial.ends).toEqual(["RA", "LP", "AL", "PR"]);
    const [xy] = sliceFrames({ point: [20, -10, 15], turn_deg: [0, 0, 10] }, BOX, null);
    expect(xy.ends).toEqual(["−x", "+x", "+y", "−y"]);
  });

  it("keep the whole specimen at one place in the image while the crosshair moves", () => {
    const [first, second] = [12, 18].map((z) =>
      sliceFrames({ point: [5, -3, z], turn_deg: [10, 20, 30] }, BOX, null),
    );
    first.forEach((frame, i) => {
      expectNear(frame.half, second[i].half);
      const corner = placeIn(frame, [40, 0, 20]);
      expect(placeIn(second[i], [40, 0, 20]).x).toBeCloseTo(corner.x, 9);
      for (const p of [BOX.min, BOX.max]) {
        const { x, y } = placeIn(frame, p);
        for (const v of [x, y]) expect(v).toBeGreaterThan(-1e-9);
        for (const v of [x, y]) expect(v).toBeLessThan(1 + 1e-9);
      }
    });
  });

  it("convert positions in an image and shares of the box to points and back", () => {
    const [frame] = sliceFrames({ point: [5, -3, 12], turn_deg: [10, 20, 30] }, BOX, null);
    const place = { x: 0.3, y: 0.8 };
    const back = placeIn(frame, pointIn(frame, place));
    expect(back.x).toBeCloseTo(place.x, 9);
    expect(back.y).toBeCloseTo(place.y, 9);
    expectNear(sharesOf(pointAt([0.25, 0.5, 1], BOX), BOX), [0.25, 0.5, 1]);
    expectNear(sharesOf([99, -99, 15], BOX), [1, 0, 0.5]);
  });

  it("are hit by a ray within the box, the nearest first", () => {
    const frames = sliceFrames({ point: [20, -10, 15], turn_deg: STRAIGHT }, BOX, null);
    const front = hitSlices({ origin: [5, -5, 99], direction: [0, 0, -1] }, frames, BOX);
    expect(front?.point).toEqual([5, -5, 15]); // the plane xy
    expect(hitSlices({ origin: [50, -5, 99], direction: [0, 0, -1] }, frames, BOX)).toBeNull();
    const side = hitSlices({ origin: [99, -5, 12], direction: [-1, 0, 0] }, frames, BOX);
    expect(side?.point).toEqual([20, -5, 12]); // the plane yz
    expect(outlineOf(frames[0], BOX)).toHaveLength(4);
  });

  it("rotate about any direction, and back", () => {
    const about: Vec3 = [0.6, 0, 0.8];
    const turned = turnedBy([10, 20, 30], about, 25);
    expectNear(turnedBy(turned, about, -25), [10, 20, 30]);
  });
});
