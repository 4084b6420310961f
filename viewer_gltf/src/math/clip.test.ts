import { describe, expect, it } from "vitest";
import { seeded } from "../../test/support/seeded";
import type { Box } from "./box";
import {
  behindPlane,
  boxHandles,
  type Clip,
  clipSpan,
  closestOnLine,
  dragBox,
  isCutAway,
  isKept,
  keptPoints,
  planeHandles,
  slidePlane,
  turnPlane,
  WHOLE,
} from "./clip";
import type { Ray, Vec3 } from "./vec3";

const SPECIMEN: Box = { min: [0, -20, 0], max: [100, 0, 50] };
const FRONT: Ray = { origin: [50, -10, 200], direction: [0, 0, -1] };

function unit(v: Vec3): Vec3 {
  const length = Math.hypot(...v);
  return [v[0] / length, v[1] / length, v[2] / length];
}

describe("the points that a clip plane leaves", () => {
  const plane = { normal: [1, 0, 0], offset_um: 2 } as const;

  it("are on the kept side of the plane, and within the original points", () => {
    const corners: Vec3[] = [
      [0, 0, 0],
      [6, 0, 0],
      [0, 3, 0],
      [6, 3, 4],
    ];
    expect(behindPlane(corners, plane)).toEqual([
      [0, 0, 0],
      [2, 0, 0],
      [0, 3, 0],
      [2, 3, 4],
    ]);
  });
});

describe("a ray's span", () => {
  it("is clipped by the box and by the plane", () => {
    const box: Box = { min: [10, -20, 10], max: [90, 0, 40] };
    const plane = { normal: [0, 0, -1], offset_um: -25 } as const; // keeps z >= 25
    const span = [150, 200] as const;
    expect(clipSpan(span, FRONT, { box: null, plane: null })).toEqual([150, 200]);
    expect(clipSpan(span, FRONT, { box, plane: null })).toEqual([160, 190]);
    expect(clipSpan(span, FRONT, { box: null, plane })).toEqual([150, 175]);
    expect(clipSpan(span, FRONT, { box, plane })).toEqual([160, 175]);
  });

  it("is null if the ray misses the kept part", () => {
    const aside: Box = { min: [60, -20, 0], max: [100, 0, 50] };
    const behind = { normal: [0, 0, 1], offset_um: -10 } as const; // keeps z <= -10
    expect(clipSpan([150, 200], FRONT, { box: aside, plane: null })).toBeNull();
    expect(clipSpan([150, 200], FRONT, { box: null, plane: behind })).toBeNull();
    const side = { normal: [1, 0, 0], offset_um: 49.9 } as const; // parallel to the ray
    expect(clipSpan([150, 200], FRONT, { box: null, plane: side })).toBeNull();
  });

  it("contains exactly the kept points, for any ray, box and plane", () => {
    const random = seeded(8);
    const anywhere = (): Vec3 => [140 * random() - 20, 60 * random() - 40, 90 * random() - 20];
    let wrong = 0;
    for (let run = 0; run < 500; run++) {
      const [a, b, origin, to] = [anywhere(), anywhere(), anywhere(), anywhere()];
      const low: Vec3 = [Math.min(a[0], b[0]), Math.min(a[1], b[1]), Math.min(a[2], b[2])];
      const high: Vec3 = [Math.max(a[0], b[0]), Math.max(a[1], b[1]), Math.max(a[2], b[2])];
      const normal = unit([random() - 0.5, random() - 0.5, random() - 0.5]);
      const clip: Clip = {
        box: random() < 0.3 ? null : { min: low, max: high },
        plane: random() < 0.3 ? null : { normal, offset_um: 60 * (random() - 0.5) },
      };
      const direction: Vec3 = [to[0] - origin[0], to[1] - origin[1], to[2] - origin[2]];
      const span = clipSpan([0, 2], { origin, direction }, clip);
      for (let t = 0.003; t < 2; t += 0.01) {
        const isNearEnd = span?.some((end) => Math.abs(end - t) < 1e-9) ?? false;
        const isIn = span !== null && t > span[0] && t < span[1];
        const p: Vec3 = [
          origin[0] + t * direction[0],
          origin[1] + t * direction[1],
          origin[2] + t * direction[2],
        ];
        if (!isNearEnd && isKept(p, clip) !== isIn) wrong++;
      }
    }
    expect(wrong).toBe(0);
  });
});

describe("a ray that begins in a removed corner", () => {
  const corner = [
    { normal: [1, 0, 0], offset_um: 10 },
    { normal: [0, 1, 0], offset_um: 20 },
    { normal: [0, 0, 1], offset_um: 30 },
  ] as const;
  const clip = { box: null, plane: null, corner };

  it("sees the kept part from where it leaves the corner", () => {
    const ahead = (origin: Vec3, direction: Vec3) =>
      clipSpan([0, 100], { origin, direction }, clip);
    expect(ahead([50, 50, 50], [0, 0, -1])).toEqual([20, 100]);
    expect(ahead([50, 50, 50], [-1, -1, 0])).toEqual([30, 100]); // at y = 20, before x = 10
    expect(ahead([50, 50, 50], [0, 0, 1])).toBeNull(); // never leaves the corner
    expect(ahead([50, 10, 50], [0, 0, -1])).toEqual([0, 100]); // passes beside the corner
    expect(isKept([11, 21, 31], clip)).toBe(false);
    expect(isKept([11, 21, 29], clip)).toBe(true);
  });
});

describe("a box that is clipped away", () => {
  const TILE: Box = { min: [10, -20, 0], max: [20, 0, 50] };

  it("is one of which nothing is left by box and plane", () => {
    const beside: Box = { min: [20, -20, 0], max: [100, 0, 50] }; // the boxes share a face
    const across: Box = { min: [19, -20, 0], max: [100, 0, 50] };
    const plane = { normal: [1, 0, 0], offset_um: 18 } as const;
    expect(isCutAway(TILE, { box: null, plane: null })).toBe(false);
    expect(isCutAway(TILE, { box: beside, plane: null })).toBe(true);
    expect(isCutAway(TILE, { box: across, plane: null })).toBe(false);
    expect(isCutAway(TILE, { box: null, plane })).toBe(false);
    expect(isCutAway(TILE, { box: across, plane })).toBe(true); // together they leave nothing
    expect(isCutAway(TILE, { box: null, plane: { ...plane, offset_um: 10 } })).toBe(true);
    const flat: Box = { min: [10, -20, 5], max: [20, 0, 5] };
    expect(isCutAway(flat, { box: flat, plane: null })).toBe(false);
  });

  it("has no kept point, for any box and plane", () => {
    const random = seeded(11);
    let [gone, wrong] = [0, 0];
    const between = (low: number, high: number) => low + (high - low) * random();
    for (let run = 0; run < 300; run++) {
      const low: Vec3 = [between(0, 25), between(-25, 0), between(-10, 50)];
      const box: Box = { min: low, max: [low[0] + 8, low[1] + 8, low[2] + 20] };
      const normal = unit([random() - 0.5, random() - 0.5, random() - 0.5]);
      const plane = { normal, offset_um: between(-40, 40) };
      const clip: Clip = { box: random() < 0.3 ? null : box, plane };
      if (!isCutAway(TILE, clip)) continue;
      gone++;
      for (let i = 0; i < 200; i++) {
        const p: Vec3 = [between(10, 20), between(-20, 0), between(0, 50)];
        if (isKept(p, clip)) wrong++;
      }
    }
    expect(wrong).toBe(0);
    expect(gone).toBeGreaterThan(30);
  });
});

describe("the point of a line that is closest to a ray", () => {
  it("is the intersection, if there is one", () => {
    const ray: Ray = { origin: [7, 5, 9], direction: [0, -3, -6] }; // meets x = 7 at y = 0.5, z = 0
    expect(closestOnLine([0, 0.5, 0], [1, 0, 0], ray)).toBeCloseTo(7);
  });

  it("has the shortest distance of all points of the line", () => {
    const ray: Ray = { origin: [3, 8, 20], direction: unit([0.2, -0.1, -1]) };
    const direction = unit([1, 2, 0.5]);
    const best = closestOnLine([1, 1, 1], direction, ray) ?? Number.NaN;
    const distance = (s: number) => {
      const p = direction.map((d, i) => 1 + s * d - ray.origin[i]);
      const t = p.reduce((sum, v, i) => sum + v * ray.direction[i], 0);
      return Math.hypot(...p.map((v, i) => v - t * ray.direction[i]));
    };
    for (const s of [-10, -1, -0.01, 0.01, 1, 10]) {
      expect(distance(best)).toBeLessThan(distance(best + s));
    }
  });

  it("is null for a parallel ray, and is not sought behind the ray's origin", () => {
    expect(closestOnLine([0, 0, 0], [0, 0, 1], FRONT)).toBeNull();
    const away: Ray = { origin: [5, 0, 9], direction: [1, 0, 1] };
    expect(closestOnLine([0, 0, 0], [1, 0, 0], away)).toBeCloseTo(5);
  });
});

describe("the clip box's handles", () => {
  it("are in the middles of the six faces", () => {
    const handles = boxHandles(SPECIMEN);
    expect(handles.map(({ position }) => position)).toEqual([
      [0, -10, 25],
      [100, -10, 25],
      [50, -20, 25],
      [50, 0, 25],
      [50, -10, 0],
      [50, -10, 50],
    ]);
    for (const { axis, side, direction } of handles) {
      expect(direction[axis]).toBe(side === "max" ? 1 : -1);
    }
  });

  it("follow the ray and move nothing else", () => {
    const ray: Ray = { origin: [30, -10, 200], direction: [0, 0, -1] };
    expect(dragBox(SPECIMEN, { axis: 0, side: "min" }, ray, SPECIMEN)).toEqual({
      min: [30, -20, 0],
      max: [100, 0, 50],
    });
    expect(dragBox(SPECIMEN, { axis: 0, side: "max" }, ray, SPECIMEN).max).toEqual([30, 0, 50]);
  });

  it("stay in place if the ray runs along their axis", () => {
    expect(dragBox(SPECIMEN, { axis: 2, side: "max" }, FRONT, SPECIMEN)).toBe(SPECIMEN);
  });

  it("never leave the specimen or pass each other, for any rays", () => {
    const random = seeded(9);
    let box = SPECIMEN;
    let isSound = true;
    for (let i = 0; i < 5000; i++) {
      const handles = boxHandles(box);
      const handle = handles[Math.floor(random() * handles.length)];
      const part = () => 400 * (random() - 0.5);
      const ray: Ray = {
        origin: [part(), part(), part()],
        direction: [part(), part(), part()],
      };
      box = dragBox(box, handle, ray, SPECIMEN);
      for (const k of [0, 1, 2]) {
        isSound &&= box.min[k] >= SPECIMEN.min[k] && box.max[k] <= SPECIMEN.max[k];
        isSound &&= box.min[k] < box.max[k];
      }
    }
    expect(isSound).toBe(true);
  });
});

describe("the clip plane's handles", () => {
  const plane = { normal: [1, 0, 0], offset_um: 30 } as const;
  const offsets = (normal: Vec3) =>
    [0, 1, 2, 3, 4, 5, 6, 7].map(
      (c) =>
        normal[0] * (c & 1 ? 100 : 0) +
        normal[1] * (c & 2 ? -20 : 0) +
        normal[2] * (c & 4 ? 50 : 0),
    );

  it("are on the plane in front of the specimen's centre, and along its normal", () => {
    expect(planeHandles(plane, SPECIMEN, 15)).toEqual({
      middle: [30, -10, 25],
      tip: [45, -10, 25],
    });
  });

  it("slide the plane to the ray, but not beyond the specimen", () => {
    const ray = (x: number): Ray => ({ origin: [x, -10, 200], direction: [0, 0, -1] });
    expect(slidePlane(plane, ray(70), SPECIMEN)).toEqual({ normal: [1, 0, 0], offset_um: 70 });
    expect(slidePlane(plane, ray(170), SPECIMEN).offset_um).toBe(100);
    expect(slidePlane(plane, ray(-70), SPECIMEN).offset_um).toBe(0);
  });

  it("turn the plane about its middle to where the ray hits the tip's sphere", () => {
    // A ray from the front, above the middle: the tip goes to (30, -10 + 9, 25 + 12).
    const ray: Ray = { origin: [30, -1, 200], direction: [0, 0, -1] };
    const tilted = turnPlane(plane, ray, SPECIMEN, 15);
    expect(tilted.normal[1]).toBeCloseTo(0.6);
    expect(Math.abs(tilted.normal[2])).toBeCloseTo(0.8);
    const beside: Ray = { origin: [30, 500, 200], direction: [0, 0, -1] };
    expect(turnPlane(plane, beside, SPECIMEN, 15).normal[1]).toBeCloseTo(1);
  });

  it("stay in place while the ray stays on them", () => {
    const { tip } = planeHandles(plane, SPECIMEN, 15);
    const ray: Ray = { origin: [tip[0] + 5, tip[1] + 3, 200], direction: [-5, -3, tip[2] - 200] };
    const turned = turnPlane(plane, ray, SPECIMEN, 15);
    expect(turned.normal[0]).toBeCloseTo(1);
    expect(turned.offset_um).toBeCloseTo(30);
  });

  it("keep the plane in the specimen, for any rays", () => {
    const random = seeded(10);
    let current: { normal: Vec3; offset_um: number } = plane;
    let isSound = true;
    for (let i = 0; i < 5000; i++) {
      const part = () => 400 * (random() - 0.5);
      const ray: Ray = {
        origin: [part(), part(), part()],
        direction: [part(), part(), part()],
      };
      const isSlide = random() < 0.5;
      current = isSlide
        ? slidePlane(current, ray, SPECIMEN)
        : turnPlane(current, ray, SPECIMEN, 15);
      const found = offsets(current.normal);
      isSound &&= Math.abs(Math.hypot(...current.normal) - 1) < 1e-9;
      isSound &&= current.offset_um >= Math.min(...found) - 1e-9;
      isSound &&= current.offset_um <= Math.max(...found) + 1e-9;
    }
    expect(isSound).toBe(true);
  });
});

describe("the points of the kept part", () => {
  const within: Box = { min: [0, 0, 0], max: [4, 4, 4] };
  const points = [
    [-1, 1, 9],
    [3, 2, 1],
  ] as const;

  it("are inside a tile that is shown alone", () => {
    const kept = keptPoints(points, WHOLE, within);
    expect(kept).toEqual([
      [0, 1, 4],
      [3, 2, 1],
    ]);
  });

  it("are also inside the clip box and behind the clip plane", () => {
    const box: Box = { min: [1, 0, 0], max: [9, 9, 3] };
    const plane = { normal: [1, 0, 0], offset_um: 2 } as const;
    const kept = keptPoints(points, { box, plane }, within);
    expect(kept).toEqual([
      [1, 1, 3],
      [2, 2, 1],
    ]);
  });
});
