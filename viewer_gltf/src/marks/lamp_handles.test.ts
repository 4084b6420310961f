import { describe, expect, it } from "vitest";
import { sampleManifest } from "../../test/support/fixture/manifest";
import type { Box } from "../math/box";
import type { Ray, Vec3 } from "../math/vec3";
import type { Action } from "../state/actions";
import { initialState } from "../state/initial_state";
import { LAMP_REACH, LAMPS } from "../state/path_trace_settings";
import { reduce } from "../state/reduce";
import type { ViewerState } from "../state/viewer_state";
import {
  dragLamp,
  LAMP_HANDLES,
  lampHandles,
  slideOnSphere,
  TIP_RAD,
  withinReach,
} from "./lamp_handles";

/** The specimen's bounds, um: the centre is at 500, -200, 100, and the longest edge is 1000. */
const SPECIMEN: Box = { min: [0, -400, 0], max: [1000, 0, 200] };
const after = (...actions: Action[]) => actions.reduce(reduce, initialState(sampleManifest(1)));
const TRACED: Action = { type: "set", id: "mode", value: "traced" };
const SHOWN: Action = { type: "set", id: "trace/lamps", value: true };
const put = (lamp: number, x: number, y: number, z: number): Action => ({
  type: "move-lamp",
  lamp,
  place: [x, y, z],
});
const length = (v: Vec3) => Math.hypot(...v);
const towards = (origin: Vec3, to: Vec3): Ray => ({
  origin,
  direction: [to[0] - origin[0], to[1] - origin[1], to[2] - origin[2]],
});
function expectAt(found: Vec3 | undefined, wanted: Vec3): void {
  wanted.forEach((v, i) => {
    expect(found?.[i]).toBeCloseTo(v, 9);
  });
}
const degrees = (angle: number) => (angle * Math.PI) / 180;

describe("the lamps' handles", () => {
  it("show only with path tracing, while lamps are shown, and for lamps that are on", () => {
    expect(LAMP_HANDLES).toHaveLength(LAMPS);
    const idsOf = (state: ViewerState) => lampHandles(state, SPECIMEN).map(({ id }) => id);
    expect(idsOf(after(SHOWN))).toEqual([]);
    expect(idsOf(after(TRACED))).toEqual([]);
    expect(idsOf(after(TRACED, SHOWN))).toEqual(["lamp-0"]);
    const lit: Action = { type: "set", id: "lamp-2/on", value: true };
    expect(idsOf(after(TRACED, SHOWN, lit))).toEqual(["lamp-0", "lamp-2"]);
  });

  it("lie where the lamps are, which is given in longest edges from the specimen's centre", () => {
    const [{ position }] = lampHandles(after(TRACED, SHOWN, put(0, -0.9, 0.5, 1.1)), SPECIMEN);
    expectAt(position, [-400, 300, 1200]);
  });
});

describe("a lamp that is dragged", () => {
  const EYE: Vec3 = [0, 0, 3];
  const slide = (from: Vec3, ray: Ray, wasBeside = false) => slideOnSphere(from, ray, wasBeside);

  it("lies on the ray and on its sphere, and stays on the same side", () => {
    expectAt(slide([0, 0, 1], towards(EYE, [0.6, 0, 0.8]))?.place, [0.6, 0, 0.8]);
    expectAt(slide([0, 0, -1], towards(EYE, [0.6, 0, -0.8]))?.place, [0.6, 0, -0.8]);
    // A ray through the centre meets both ends of the diameter.
    expectAt(slide([0.1, 0, 0.9], towards(EYE, [0, 0, 0]))?.place, [0, 0, Math.hypot(0.1, 0.9)]);
  });

  it("lies ahead of the eye if the sphere surrounds the eye", () => {
    const inside: Vec3 = [0, 0, 2];
    for (const from of [
      [0, 3, 0],
      [0, 0, 3],
      [0, 0, -3],
    ] as const) {
      expectAt(slide(from, towards(inside, [0, 0, 0]))?.place, [0, 0, -3]);
      expectAt(slide(from, towards(inside, [0, 0, 9]))?.place, [0, 0, 3]);
    }
  });

  it("moves across the rim that the eye sees, and then along it", () => {
    const eye: Vec3 = [0, 0, 2]; // the rim of a sphere of radius 1 is 60 degrees away from the eye's direction
    const at = (angle: number, x: number, y: number): Vec3 => [
      x * Math.sin(angle),
      y * Math.sin(angle),
      Math.cos(angle),
    ];
    const rim = degrees(60);
    const right: Ray = { origin: eye, direction: [1, 0, -0.1] };
    const up: Ray = { origin: eye, direction: [0, 1, 0.5] };
    const over = slide([0, 0, 1], right);
    expectAt(over?.place, at(rim + TIP_RAD, 1, 0));
    expect(over?.isBeside).toBe(true);
    const along = slide(at(rim + TIP_RAD, 1, 0), up, true);
    expectAt(along?.place, at(rim + TIP_RAD, 0, 1));
    const back = slide(at(rim + TIP_RAD, 0, 1), towards(eye, at(degrees(90), 0, 1)), true);
    expectAt(back?.place, at(degrees(90), 0, 1));
    expect(back?.isBeside).toBe(false);
    // The lamp also moves from behind to the front.
    expectAt(slide(at(degrees(90), 0, 1), up)?.place, at(rim - TIP_RAD, 0, 1));
    expectAt(slide(at(rim - TIP_RAD, 0, 1), right, true)?.place, at(rim - TIP_RAD, 1, 0));
  });

  it("moves behind the sphere and back when rays go out and in, for any step size", () => {
    for (const step of [0.01, 0.13, 0.7, 3]) {
      let lamp: Vec3 = [0, 0, 1];
      let wasBeside = false;
      const pull = (angle: number) => {
        const direction: Vec3 = [Math.sin(degrees(angle)), 0, -Math.cos(degrees(angle))];
        const slid = slide(lamp, { origin: [0, 0, 2.5], direction }, wasBeside);
        if (slid === null) throw new Error("no place");
        lamp = slid.place;
        wasBeside = slid.isBeside;
      };
      const goOutAndIn = () => {
        for (let angle = 10; angle < 30; angle += step) pull(angle); // the rim is at 23.6 degrees
        for (let angle = 30; angle > 10; angle -= step) pull(angle);
      };
      goOutAndIn();
      expect(lamp[2], `${step}`).toBeLessThan(0);
      expect(length(lamp)).toBeCloseTo(1, 9);
      goOutAndIn();
      expect(lamp[2], `${step}`).toBeGreaterThan(0.4);
      expect(length(lamp)).toBeCloseTo(1, 9);
    }
  });

  it("stays if the ray defines no place: for a lamp at the centre, or a ray straight away from it", () => {
    expect(slide([0, 0, 0], towards(EYE, [0, 1, 0]))).toBeNull();
    expect(slide([0, 1, 0], towards(EYE, [0, 0, 9]))).toBeNull();
  });

  it("is moved by the action, with um converted to edges and back, and only while it has a handle", () => {
    const state = after(TRACED, SHOWN, put(0, 0, 0, 1));
    const ray = towards([500, -200, 3100], [1100, -200, 900]); // meets (0.6, 0, 0.8), in edges
    const drag = dragLamp("lamp-0", ray, state, SPECIMEN, false);
    if (drag?.action?.type !== "move-lamp") throw new Error("no drag");
    expect(drag.action.lamp).toBe(0);
    expectAt(drag.action.place, [0.6, 0, 0.8]);
    const moved = reduce(state, drag.action);
    expect(moved.trace.lamps.slice(1)).toEqual(state.trace.lamps.slice(1));
    const again = dragLamp("lamp-0", ray, moved, SPECIMEN, false);
    expect(again).toEqual({ action: null, isBeside: false }); // path tracing does not restart
    expect(dragLamp("lamp-1", ray, state, SPECIMEN, false)).toBeNull(); // off
    const hidden = reduce(state, { type: "set", id: "trace/lamps", value: false });
    expect(dragLamp("lamp-0", ray, hidden, SPECIMEN, false)).toBeNull();
  });
});

describe("the lamps' reach", () => {
  it("leaves places within it unchanged", () => {
    expect(withinReach([1, -2, 3])).toEqual([1, -2, 3]);
  });

  it("limits a place without changing its distance", () => {
    expectAt(withinReach([4, 0, 0]), [3, Math.sqrt(3.5), Math.sqrt(3.5)]);
    expectAt(withinReach([-4, 0, 1]), [-3, 0, Math.sqrt(8)]);
    const most = LAMP_REACH * Math.sqrt(3);
    for (let i = 0; i < 400; i++) {
      const [u, angle] = [((i * 0.618) % 1) * 2 - 1, i * 2.4];
      const radius = 0.1 + (most - 0.1) * ((i * 0.414) % 1);
      const round = Math.sqrt(1 - u * u);
      const wanted: Vec3 = [
        radius * round * Math.cos(angle),
        radius * round * Math.sin(angle),
        radius * u,
      ];
      const kept = withinReach(wanted);
      expect(length(kept)).toBeCloseTo(radius, 9);
      expect(Math.max(...kept.map(Math.abs))).toBeLessThan(LAMP_REACH + 1e-9);
      kept.forEach((v, k) => {
        expect(v * wanted[k]).toBeGreaterThanOrEqual(0); // on the same side of each axis
      });
    }
  });

  it("lets a drag continue where the sphere extends beyond it", () => {
    const state = after(TRACED, SHOWN, put(0, 2, 0, 3));
    const beyond: Vec3 = [3.5, 0.5, Math.sqrt(0.5)]; // at the same distance from the centre
    const [x, y, z] = beyond.map((v, i) => 1000 * v + [500, -200, 100][i]);
    const drag = dragLamp("lamp-0", towards([9500, -200, 100], [x, y, z]), state, SPECIMEN, false);
    if (drag?.action == null) throw new Error("no drag");
    const lamp = reduce(state, drag.action).trace.lamps[0];
    const share = Math.sqrt(4 / 0.75); // factor by which the other two coordinates grow
    expectAt([lamp.x, lamp.y, lamp.z], [LAMP_REACH, 0.5 * share, Math.sqrt(0.5) * share]);
  });
});
