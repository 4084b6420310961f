import { describe, expect, it } from "vitest";
import type { Manifest } from "../bundle/generated/bundle";
import { stageViews } from "./stage_views";

const MANIFEST = {
  specimen: { bounds_um: { min: [0, -10, 0], max: [20, 0, 4] } },
  views: [
    { name: "Close", position_um: [10, -5, 22], target_um: [10, -5, 2], fov_deg: 40 },
    { name: "Wide", position_um: [10, -5, 22], target_um: [10, -5, 2], fov_deg: 80 },
  ],
} as unknown as Manifest;

describe("the views of a stage's cameras", () => {
  it("are in metres around the specimen's centre, in the stage's order", () => {
    const [close] = stageViews(MANIFEST);
    expect(close.name).toBe("Close");
    expect(close.target).toEqual([0, 0, 0]);
    expect(close.position[2]).toBeCloseTo((20 / 20) * 1.2, 9); // the longest edge, 20, is 1.2 m in the scene
  });

  it("show the same extent at the target as the stage's camera", () => {
    const wide = stageViews(MANIFEST)[1];
    const half = wide.position[2] * Math.tan((20 * Math.PI) / 180);
    expect(half).toBeCloseTo(1.2 * Math.tan((40 * Math.PI) / 180), 9);
  });

  it("are empty if the stage has no camera", () => {
    expect(stageViews({ ...MANIFEST, views: undefined })).toEqual([]);
  });
});
