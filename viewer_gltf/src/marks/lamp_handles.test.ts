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

/** Its middle is at 500, -200, 100, its longest edge 1000. */
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
  it("are there in the traced picture, when they are asked for, of the lamps that are on", () => {
    expect(LAMP_HANDLES).toHaveLength(LAMPS);
    const idsOf = (state: ViewerState) => lampHandles(state, SPECIMEN).map(({ id }) => id);
    expect(idsOf(after(SHOWN))).toEqual([]);
    expect(idsOf(after(TRACED))).toEqual([]);
    expect(idsOf(after(TRACED, SHOWN))).toEqual(["lamp-0"]);
    const lit: Action = { type: "set", id: "lamp-2/on", value: true };
    expect(idsOf(after(TRACED, SHOWN, lit))).toEqual(["lamp-0", "lamp-2"]);
  });

  it("lie where the lamps are: in longest edges from the specimen's middle", () => {
    const [{ position }] = lampHandles(after(TRACED, SHOWN, put(0, -0.9, 0.5, 1.1)), SPECIMEN);
    expectAt(position, [-400, 300, 1200]);
  });
});

describe("a lamp that is dragged", () => {
  const EYE: Vec3 = [0, 0, 3];
  const slide = (from: Vec3, ray: Ray, wasBeside = false) => slideOnSphere(from, ray, wasBeside);

  it("lies on the ray and on its sphere, on the side on which it was", () => {
    expectAt(slide([0, 0, 1], towards(EYE, [0.6, 0, 0.8]))?.place, [0.6, 0, 0.8]);
    expectAt(slide([0, 0, -1], towards(EYE, [0.6, 0, -0.8]))?.place, [0.6, 0, -0.8]);
    // through the middle: either end of the diameter
    expectAt(slide([0.1, 0, 0.9], towards(EYE, [0, 0, 0]))?.place, [0, 0, Math.hypot(0.1, 0.9)]);
  });

  it("around the eye lies ahead", () => {
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

  it("goes over the rim that the eye sees, and then along it", () => {
    const eye: Vec3 = [0, 0, 2]; // a sphere of 1 has its rim 60 degrees from the eye's side
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
    // and from behind to the front
    expectAt(slide(at(degrees(90), 0, 1), up)?.place, at(rim - TIP_RAD, 0, 1));
    expectAt(slide(at(rim - TIP_RAD, 0, 1), right, true)?.place, at(rim - TIP_RAD, 1, 0));
  });

  it("rolls behind and back by rays that go out and in, however fine their steps are", () => {
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
        for (let angle = 10; angle < 30; angle += step) pull(angle); // the rim: 23.6 degrees
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

  it("stays where no place is meant: in the very middle, or straight away from it", () => {
    expect(slide([0, 0, 0], towards(EYE, [0, 1, 0]))).toBeNull();
    expect(slide([0, 1, 0], towards(EYE, [0, 0, 9]))).toBeNull();
  });

  it("is moved by the action, in um and out of them, and only while it is there", () => {
    const state = after(TRACED, SHOWN, put(0, 0, 0, 1));
    const ray = towards([500, -200, 3100], [1100, -200, 900]); // 0.6, 0, 0.8
    const drag = dragLamp("lamp-0", ray, state, SPECIMEN, false);
    if (drag?.action?.type !== "move-lamp") throw new Error("no drag");
    expect(drag.action.lamp).toBe(0);
    expectAt(drag.action.place, [0.6, 0, 0.8]);
    const moved = reduce(state, drag.action);
    expect(moved.trace.lamps.slice(1)).toEqual(state.trace.lamps.slice(1));
    const again = dragLamp("lamp-0", ray, moved, SPECIMEN, false);
    expect(again).toEqual({ action: null, isBeside: false }); // it begins no picture anew
    expect(dragLamp("lamp-1", ray, state, SPECIMEN, false)).toBeNull(); // off
    const hidden = reduce(state, { type: "set", id: "trace/lamps", value: false });
    expect(dragLamp("lamp-0", ray, hidden, SPECIMEN, false)).toBeNull();
  });
});

describe("the lamps' reach", () => {
  it("leaves what lies within it", () => {
    expect(withinReach([1, -2, 3])).toEqual([1, -2, 3]);
  });

  it("is kept at the same distance", () => {
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

  it("lets a drag go on where the sphere is cut by it", () => {
    const state = after(TRACED, SHOWN, put(0, 2, 0, 3));
    const beyond: Vec3 = [3.5, 0.5, Math.sqrt(0.5)]; // as far from the middle
    const [x, y, z] = beyond.map((v, i) => 1000 * v + [500, -200, 100][i]);
    const drag = dragLamp("lamp-0", towards([9500, -200, 100], [x, y, z]), state, SPECIMEN, false);
    if (drag?.action == null) throw new Error("no drag");
    const lamp = reduce(state, drag.action).trace.lamps[0];
    const share = Math.sqrt(4 / 0.75); // of the other two: they make up for it
    expectAt([lamp.x, lamp.y, lamp.z], [LAMP_REACH, 0.5 * share, Math.sqrt(0.5) * share]);
  });
});
