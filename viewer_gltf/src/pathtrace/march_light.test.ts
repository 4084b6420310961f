import { Matrix4, Vector3 } from "three";
import { describe, expect, it } from "vitest";
import { GLOSS } from "../gpu/scene_light";
import { START_TRACE } from "../state/path_trace_settings";
import { marchLight } from "../voxels/march_frame";
import { environmentTables } from "./environment_sampling";
import { hemispheresOf, lightMarch } from "./march_light";

const roomOf = (height: number, ...rows: readonly number[]) =>
  hemispheresOf(
    environmentTables({
      ...{ width: 2, height },
      rgb: Float32Array.from(rows.flatMap((v) => [v, v / 2, 0, v, v / 2, 0])),
    }),
  );

describe("the light of the ray-marched frame that stands in for path tracing", () => {
  it("has the environment's mean radiance above and below", () => {
    const { sky, ground } = roomOf(2, 4, 1);
    expect([...sky, ...ground]).toEqual([4, 2, 0, 1, 0.5, 0]);
  });

  it("divides a row across the horizon between both halves by solid angle", () => {
    // The middle one of three rows reaches from 60 to 120 degrees, which is half of each half of the sphere.
    const { sky, ground } = roomOf(3, 8, 2, 0);
    expect(sky[0]).toBeCloseTo(5, 5);
    expect(ground[0]).toBeCloseTo(1, 5);
  });

  it("has the strongest lamp as key light and the others as one second lamp, in the eye's axes", () => {
    const [lamp] = START_TRACE.lamps;
    const lamps = [
      { ...lamp, isOn: true, x: 0, y: 2, z: 0, strength: 1, color: [0, 1, 0] as const },
      { ...lamp, isOn: true, x: 0, y: 0, z: -3, strength: 4, color: [1, 0, 0] as const },
      { ...lamp, isOn: false, x: 1, y: 0, z: 0, strength: 9 },
    ];
    const light = marchLight();
    const settings = { ...START_TRACE, lamps, environmentLight: 2 };
    const toEye = new Matrix4().makeRotationY(Math.PI / 2); // -z of the specimen becomes -x of the eye
    lightMarch(light, settings, roomOf(2, 3, 1), toEye);
    expect(light.uKeyLight.value.toArray()).toEqual([4, 0, 0]);
    expect(light.uLight.value.distanceTo(new Vector3(-1, 0, 0))).toBeLessThan(1e-6);
    expect(light.uFillLight.value.toArray()).toEqual([0, 1, 0]);
    expect(light.uFill.value.distanceTo(new Vector3(0, 1, 0))).toBeLessThan(1e-6);
    expect(light.uSkyLight.value.x).toBe(6);
    expect(light.uGloss.value).toBeCloseTo(GLOSS, 6);
  });

  it("has no lamps if none is on", () => {
    const light = marchLight();
    const lamps = START_TRACE.lamps.map((lamp) => ({ ...lamp, isOn: false }));
    lightMarch(light, { ...START_TRACE, lamps }, roomOf(2, 1, 1), new Matrix4());
    expect(light.uKeyLight.value.length() + light.uFillLight.value.length()).toBe(0);
    expect(light.uLight.value.length()).toBeCloseTo(1, 6);
  });
});
