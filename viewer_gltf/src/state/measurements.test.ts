import { describe, expect, it } from "vitest";
import { sampleManifest } from "../../test/support/fixture/manifest";
import type { Vec3 } from "../math/vec3";
import type { Action } from "./actions";
import { initialState } from "./initial_state";
import { allOf, angleOf, lengthOf, MAX_MEASUREMENTS, measurementsCsv } from "./measurements";
import { MEASURE_KIND, type MeasureKind } from "./parameters/tools";
import { reduce } from "./reduce";

const START = initialState(sampleManifest(1));
const point = (...at: Vec3): Action => ({ type: "add-point", point: at });
const kind = (value: MeasureKind): Action => ({ type: "set", id: MEASURE_KIND.id, value });
const after = (...actions: readonly Action[]) => actions.reduce(reduce, START);

describe("measuring", () => {
  it("takes two points for a distance; a third point begins another", () => {
    const two = after(point(0, 0, 0), point(3, 4, 0));
    expect(two.measured).toHaveLength(2);
    expect(lengthOf(two.measured)).toBe(5);
    const three = reduce(two, { type: "add-point", point: [9, 9, 9] });
    expect(three.measured).toEqual([[9, 9, 9]]);
    expect(three.measurements).toEqual([
      { name: "Distance 1", kind: "distance", points: two.measured },
    ]);
  });

  it("takes three points for an angle, and measures at the second", () => {
    const state = after(kind("angle"), point(1, 0, 0), point(0, 0, 0), point(0, 2, 0));
    expect(angleOf(state.measured)).toBeCloseTo(90, 12);
    expect(
      angleOf([
        [1, 0, 0],
        [0, 0, 0],
        [-3, 0, 0],
      ]),
    ).toBe(180);
    expect(
      angleOf([
        [1, 1, 0],
        [0, 0, 0],
        [1, 0, 0],
      ]),
    ).toBeCloseTo(45, 12);
    expect(
      angleOf([
        [1, 0, 0],
        [1, 0, 0],
        [0, 2, 0],
      ]),
    ).toBeNull();
    expect(allOf(state).map(({ name }) => name)).toEqual(["Angle 1"]);
  });

  it("adds points to a line until it is finished", () => {
    const line = after(
      kind("line"),
      point(0, 0, 0),
      point(1, 0, 0),
      point(1, 1, 0),
      point(1, 1, 5),
    );
    expect(lengthOf(line.measured)).toBe(7);
    const done = reduce(line, { type: "finish-measuring" });
    expect([done.measured, done.measurements[0].kind]).toEqual([[], "line"]);
    expect(reduce(done, { type: "finish-measuring" })).toBe(done);
  });

  it("drops a single point and begins again when another kind is chosen", () => {
    const other = after(point(0, 0, 0), kind("angle"), point(1, 0, 0));
    expect([other.measured, other.measuredAs, other.measurements]).toEqual([
      [[1, 0, 0]],
      "angle",
      [],
    ]);
  });

  it("gives each measurement a name of its own, up to the largest number", () => {
    const many = Array.from({ length: 2 * MAX_MEASUREMENTS + 9 }, (_, i) => [
      point(i, 0, 0),
      point(i, 1, 0),
    ]).flat();
    const names = after(...many).measurements.map(({ name }) => name);
    expect(names).toHaveLength(MAX_MEASUREMENTS);
    expect(new Set(names).size).toBe(MAX_MEASUREMENTS);
  });
});

describe("the file of measurements", () => {
  it("has a line for each measurement that spreadsheets read as text and numbers", () => {
    const csv = measurementsCsv([
      {
        name: 'wall, "left"',
        kind: "distance",
        points: [
          [0, 0, 0],
          [3, 4, 0],
        ],
      },
      {
        name: "=1+1",
        kind: "angle",
        points: [
          [1, 0, 0],
          [0, 0, 0],
          [0, 2, 0],
        ],
      },
    ]);
    expect(csv.split("\r\n")).toEqual([
      "name,kind,length_um,angle_deg,x1_um,y1_um,z1_um,x2_um,y2_um,z2_um,x3_um,y3_um,z3_um",
      '"wall, ""left""",distance,5,,0,0,0,3,4,0,,,',
      "'=1+1,angle,,90,1,0,0,0,0,0,0,2,0",
      "",
    ]);
  });
});
