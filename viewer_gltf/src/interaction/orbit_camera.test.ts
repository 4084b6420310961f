import { Spherical, Vector3 } from "three";
import { describe, expect, it } from "vitest";
import { cornersOf } from "../math/box";
import { place } from "../render/placement";
import { Navigation } from "./orbit_camera";

function start(): Navigation {
  const canvas = Object.assign(new EventTarget(), { ownerDocument: new EventTarget(), style: {} });
  const navigation = new Navigation(
    canvas as unknown as HTMLElement,
    place({ min: [0, -48, 0], max: [64, 0, 24] }),
    () => {},
  );
  navigation.fit(1.5);
  return navigation;
}

const azimuth = ({ camera, controls }: Navigation) =>
  new Spherical().setFromVector3(new Vector3().subVectors(camera.position, controls.target)).theta;

describe("a glide", () => {
  it("takes the same time at low and high frame rates, and ends at the same place", () => {
    const ways = [60, 10, 5].map((frames) => {
      const navigation = start();
      navigation.openAt("front");
      navigation.update(1 / frames);
      navigation.controls.rotateLeft(0.6); // moves by its share of a frame at once
      const first = azimuth(navigation);
      const after: number[] = [];
      for (const seconds of [0.2, 0.4, 3]) {
        const from = after.length === 0 ? 0 : [0.2, 0.4][after.length - 1];
        for (let k = 0; k < Math.round((seconds - from) * frames); k++) {
          navigation.update(1 / frames);
        }
        after.push((azimuth(navigation) - first) / (-0.6 - first));
      }
      return after;
    });
    for (const [early, later, end] of ways) {
      expect(early).toBeCloseTo(1 - 0.88 ** 12, 2);
      expect(later).toBeCloseTo(1 - 0.88 ** 24, 2);
      expect(end).toBeCloseTo(1, 4);
    }
  });
});

const eye = ({ camera }: Navigation) => camera.position.toArray().map((v) => Number(v.toFixed(6)));

describe("the opening", () => {
  it("is framed in the middle of the uncovered part of the image", () => {
    const [min, max] = [
      [-0.6, -0.45, -0.225],
      [0.6, 0.45, 0.225],
    ];
    for (const [aspect, top, bottom] of [
      [1.5, 0, 0],
      [0.84, 0.12, 0.24],
      [1.5, 0.15, 0],
    ]) {
      const navigation = start();
      navigation.fit(aspect, { top, bottom });
      navigation.camera.updateMatrixWorld();
      // from the left and from the upper edge of the image, 0 to 1
      const corners = Array.from({ length: 8 }, (_, i) => {
        const corner = [0, 1, 2].map((axis) => ((i >> axis) & 1 ? max : min)[axis]);
        const { x, y } = new Vector3(...corner).project(navigation.camera);
        return [(1 + x) / 2, (1 - y) / 2] as const;
      });
      const across = corners.map(([x]) => x);
      const down = corners.map(([, y]) => y);
      const [first, last] = [Math.min(...down), Math.max(...down)];
      expect(first).toBeGreaterThan(top);
      expect(last).toBeLessThan(1 - bottom);
      expect((first + last) / 2).toBeCloseTo((1 + top - bottom) / 2, 2);
      expect((Math.min(...across) + Math.max(...across)) / 2).toBeCloseTo(0.5, 2);
      expect(last - first).toBeGreaterThan(0.5 * (1 - top - bottom));
    }
  });

  it("is inside the image even if the covering elements are higher than the image", () => {
    for (const covered of [
      { top: 0.7, bottom: 0.3 },
      { top: 2, bottom: 1 },
    ]) {
      const navigation = start();
      navigation.fit(8, covered);
      navigation.reset();
      const { position, target } = navigation.cameraPose;
      const away_m = Math.hypot(...position.map((v, i) => v - target[i]));
      expect(away_m).toBeGreaterThan(0.1);
      expect(away_m).toBeLessThan(20);
    }
  });

  it("swings slowly until the user moves, and then stays where it is", () => {
    const navigation = start();
    const still = azimuth(navigation);
    navigation.turnSlowly();
    const away: number[] = [];
    const turned = Array.from({ length: 120 }, () => {
      navigation.update(0.5);
      away.push(navigation.camera.position.distanceTo(navigation.controls.target));
      return azimuth(navigation) - still;
    });
    expect(Math.max(...turned)).toBeCloseTo(Math.PI / 10, 1);
    expect(Math.min(...turned)).toBeCloseTo(-Math.PI / 10, 1);
    expect(navigation.openingDistance_m).toBeGreaterThan(Math.max(...away) - 1e-3);
    expect(navigation.openingDistance_m).toBeLessThan(Math.max(...away) + 0.01);
    navigation.update(3);
    const before = eye(navigation);
    expect(navigation.look).not.toBeNull(); // a link has to contain the camera
    navigation.stopTurning();
    navigation.update(5);
    expect(eye(navigation)).toEqual(before);
    expect(navigation.look).not.toBeNull();
    navigation.reset();
    expect(azimuth(navigation)).toBeCloseTo(still);
    expect(navigation.look).toBeNull();
  });

  it("is framed on the occupied part of the specimen, and follows the window's shape", () => {
    const navigation = start();
    const far = navigation.camera.position.length();
    // One corner of the specimen, a third as large.
    navigation.setOccupied(cornersOf({ min: [0, -16, 0], max: [16, 0, 8] }));
    const { target } = navigation.controls;
    expect(target.x).toBeLessThan(0);
    expect(target.y).toBeGreaterThan(0);
    const near = navigation.camera.position.distanceTo(target);
    expect(near).toBeLessThan(far / 2);
    navigation.fit(0.5);
    expect(navigation.camera.position.distanceTo(target)).toBeGreaterThan(1.2 * near);
  });

  it("is not cut off by its slow turn, and stays as large as fits", () => {
    const navigation = start();
    const stick = [0, 1].map((i) => [64 * i, -48 * i, 24 * i] as const); // from corner to corner
    navigation.setOccupied(stick);
    navigation.turnSlowly();
    const { center, scale } = place({ min: [0, -48, 0], max: [64, 0, 24] });
    for (let k = 0; k < 60; k++) {
      navigation.update(0.5);
      const seen = stick.map((point) => {
        const inScene = point.map((v, i) => (v - center[i]) * scale);
        return new Vector3(...inScene).project(navigation.camera);
      });
      const most = Math.max(...seen.flatMap(({ x, y }) => [Math.abs(x), Math.abs(y)]));
      expect(most).toBeLessThan(0.95);
      expect(most).toBeGreaterThan(0.9);
    }
  });

  it("may be another view, and reset then returns to it", () => {
    const navigation = start();
    navigation.openAt("front");
    navigation.turnSlowly();
    navigation.update(4);
    expect(eye(navigation).slice(0, 2)).toEqual([0, 0]);
    // A link must contain the camera, since it does not contain the opening of the address.
    expect(navigation.look).not.toBeNull();
    expect(navigation.run("side")).toBe(true);
    expect(navigation.look).not.toBeNull();
    navigation.fit(0.5); // the view follows the window's shape, too
    expect(eye(navigation)[0]).toBeGreaterThan(1);
    navigation.reset();
    expect(eye(navigation).slice(0, 2)).toEqual([0, 0]);
  });
});
