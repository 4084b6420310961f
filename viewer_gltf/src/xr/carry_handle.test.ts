import { Vector3 } from "three";
import { describe, expect, it } from "vitest";
import type { Met, RoomRay, Target } from "../interaction/ray_pointer";
import { GazeCarry } from "./carry_handle";

const look = (yaw_deg: number): RoomRay => {
  const yaw = (yaw_deg * Math.PI) / 180;
  return { origin: new Vector3(), direction: new Vector3(Math.sin(yaw), 0, -Math.cos(yaw)) };
};

describe("a handle that the gaze carries", () => {
  const dragged: RoomRay[] = [];
  const target: Target = {
    isOnTop: true,
    meet: () => null,
    choose: () => undefined,
    drag: (_key, ray) => dragged.push(ray),
  };
  const met: Met = { key: "h", distance_m: 1.3, hold: "carry", target, ray: look(0) };

  it("follows the gaze until it is put down, and keeps its distance", () => {
    const carry = new GazeCarry();
    expect([carry.follow(look(0)), carry.meet()]).toEqual([false, null]);
    carry.take(met);
    expect(carry.follow(look(5))).toBe(true);
    expect(dragged).toEqual([look(5)]);
    expect(carry.meet()?.distance_m).toBe(1.3);
    carry.choose();
    expect(carry.follow(look(6))).toBe(false);
  });

  it("counts a trembling gaze as resting, and a turn as a new gaze", () => {
    const carry = new GazeCarry();
    carry.take(met);
    carry.follow(look(0));
    const resting = carry.meet()?.key;
    carry.follow(look(1));
    expect(carry.meet()?.key).toBe(resting);
    carry.follow(look(2));
    expect(carry.meet()?.key).not.toBe(resting);
  });
});
