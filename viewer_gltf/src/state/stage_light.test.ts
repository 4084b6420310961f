import { describe, expect, it } from "vitest";
import { sampleManifest } from "../../test/support/fixture/manifest";
import type { Lights } from "../bundle/generated/bundle";
import { OWN_LIGHT } from "../gpu/scene_light";
import { initialState } from "./initial_state";
import { setTo, withValue } from "./parameters/kinds";
import { ENVIRONMENT } from "./parameters/light";
import { START_TRACE } from "./path_trace_settings";
import { sceneLightOf } from "./stage_light";

const manifest = sampleManifest(1);
const { min, max } = manifest.specimen.bounds_um;
const edge = Math.max(...max.map((v, k) => v - min[k]));
const middle = max.map((v, k) => (v + min[k]) / 2);
const lamp = { name: "L", color: [1, 0.5, 0] as [number, number, number] };
const file = { path: "room.exr", bytes: 1, sha256: "0".repeat(64) };

const lit = (lights: Lights) => ({ ...manifest, lights });

describe("the light of a stage", () => {
  it("is the viewer's own light if no layer has lights", () => {
    expect(sceneLightOf(manifest)).toBe(OWN_LIGHT);
    expect(initialState(manifest).trace).toBe(START_TRACE);
  });

  it("moves with the specimen: the strongest lamp is the key light, all others are joined to one fill light", () => {
    const light = sceneLightOf(
      lit({
        lamps: [
          { ...lamp, strength: 2, towards: [1, 0, 0], position_um: null },
          { ...lamp, strength: 1, towards: [0, 1, 0], position_um: null },
          { ...lamp, strength: 1, towards: null, position_um: [middle[0], middle[1], max[2] + 9] },
        ],
        room: { sky: [0.5, 0.5, 0.5], ground: [0.1, 0, 0], image: file },
      }),
    );
    expect(light.standsWith).toBe("specimen");
    expect(light.key).toEqual({ light: [2, 1, 0], towards: [2, 0, 0] });
    expect(light.fill.light).toEqual([2, 1, 0]);
    expect(light.fill.towards[1]).toBeCloseTo(1, 6);
    expect(light.fill.towards[2]).toBeCloseTo(1, 6);
    expect(light.sky).toEqual([0.5, 0.5, 0.5]);
    expect(light.ground).toEqual([0.1, 0, 0]);
  });

  it("places a lamp of path tracing where it stands, or at the farthest place of a lamp", () => {
    const at = [middle[0] + edge, middle[1], middle[2]] as [number, number, number];
    const { trace } = initialState(
      lit({
        lamps: [
          { ...lamp, strength: 2, towards: null, position_um: at },
          { ...lamp, strength: 1, towards: [0, 0.6, -0.8], position_um: null },
        ],
      }),
    );
    const [near, far, none] = trace.lamps;
    expect([near.x, near.y, near.z]).toEqual([1, 0, 0]);
    expect([far.x, far.y, far.z].map((v) => Number(v.toFixed(6)))).toEqual([0, 2.25, -3]);
    expect(far).toMatchObject({ isOn: true, color: lamp.color, strength: 1 });
    expect(none.isOn).toBe(false);
    expect(trace.environmentLight).toBe(0);
  });

  it("offers the stage's environment only if the stage has dome lights", () => {
    const dark = initialState(lit({ lamps: [] }));
    const roomed = initialState(
      lit({ lamps: [], room: { sky: [1, 1, 1], ground: [1, 1, 1], image: file } }),
    );
    expect(roomed.trace.environment).toBe("stage");
    expect(ENVIRONMENT.options?.(roomed)).toContain("stage");
    expect(ENVIRONMENT.options?.(dark)).not.toContain("stage");
    expect(setTo(ENVIRONMENT, "stage").value).toBe("stage");
    expect(withValue(ENVIRONMENT, dark, "stage")).toBe(dark);
  });
});
