import { Spherical, Vector3 } from "three";
import { describe, expect, it } from "vitest";
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
  it("takes as long at few frames a second as at many, and ends at the same place", () => {
    const ways = [60, 10, 5].map((frames) => {
      const navigation = start();
      navigation.update(1 / frames);
      navigation.controls.rotateLeft(0.6); // moves by its own share of a frame at once
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
