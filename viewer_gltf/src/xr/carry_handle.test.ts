import { Vector3 } from "three";
import { describe, expect, it } from "vitest";
import type { SceneRay, Target, TargetHit } from "../interaction/ray_pointer";
import { GazeCarry } from "./carry_handle";

const look = (yaw_deg: number): SceneRay => {
  const yaw = (yaw_deg * Math.PI) / 180;
  return { origin: new Vector3(), direction: new Vector3(Math.sin(yaw), 0, -Math.cos(yaw)) };
};

describe("a handle that the gaze carries", () => {
  const dragged: SceneRay[] = [];
  const target: Target = {
    isOnTop: true,
    intersect: () => null,
    choose: () => undefined,
    drag: (_key, ray) => dragged.push(ray),
  };
  const hit: TargetHit = { key: "h", distance_m: 1.3, hold: "carry", target, ray: look(0) };

  it("follows the gaze until it is put down, and keeps its distance", () => {
    const carry = new GazeCarry();
    expect([carry.follow(look(0)), carry.intersect()]).toEqual([false, null]);
    carry.take(hit);
    expect(carry.follow(look(5))).toBe(true);
    expect(dragged).toEqual([look(5)]);
    expect(carry.intersect()?.distance_m).toBe(1.3);
    carry.choose();
    expect(carry.follow(look(6))).toBe(false);
  });

  it("counts a trembling gaze as resting, and a turn as a new gaze", () => {
    const carry = new GazeCarry();
    carry.take(hit);
    carry.follow(look(0));
    const resting = carry.intersect()?.key;
    carry.follow(look(1));
    expect(carry.intersect()?.key).toBe(resting);
    carry.follow(look(2));
    expect(carry.intersect()?.key).not.toBe(resting);
  });
});
