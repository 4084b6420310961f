import { Matrix4, Vector3 } from "three";
import { describe, expect, it } from "vitest";
import { firstHit, gazeOf, type Hit, Pointer, type SceneRay, type Target } from "./ray_pointer";

const AHEAD: SceneRay = { origin: new Vector3(), direction: new Vector3(0, 0, -1) };
const FRAME_S = 1 / 60;

function target(key: string | null, distance_m: number | null, isOnTop = false): Target {
  const intersect = (): Hit | null => (distance_m === null ? null : { key, distance_m });
  return { isOnTop, intersect, choose: () => undefined };
}

describe("the first hit of a ray", () => {
  it("is the nearest target, in any order of the targets", () => {
    const [near, far] = [target("near", 1), target("far", 2)];
    expect(firstHit(AHEAD, [far, near])?.key).toBe("near");
    expect(firstHit(AHEAD, [near, far])?.key).toBe("near");
  });

  it("is a target that is drawn on top, even if another is nearer", () => {
    const handle = target("handle", 3, true);
    expect(firstHit(AHEAD, [target("panel", 1), handle, target("tile", 2)])?.key).toBe("handle");
  });

  it("is null if the ray misses all targets", () => {
    expect(firstHit(AHEAD, [target("a", null), target("b", null, true)])).toBeNull();
  });

  it("is on a ray from the eye straight ahead of the head", () => {
    const head = new Matrix4().makeRotationY(Math.PI / 2).setPosition(1, 2, 3);
    const { origin, direction } = gazeOf(head);
    expect(origin.toArray()).toEqual([1, 2, 3]);
    expect(direction.distanceTo(new Vector3(-1, 0, 0))).toBeLessThan(1e-12);
  });
});

describe("the gaze", () => {
  const tile = target("tile", 1.5);
  /** Seconds of looking until the first choice; null if there is none within 4 s. */
  const untilChosen = (
    hands: readonly (SceneRay | null)[],
    targets: readonly Target[],
    isDwellOn = true,
  ) => {
    const pointer = new Pointer();
    for (let frame = 0; frame * FRAME_S < 4; frame++) {
      if (pointer.advance(AHEAD, hands, targets, FRAME_S, isDwellOn)) return frame * FRAME_S;
    }
    return null;
  };

  it("chooses after 1.5 s", () => {
    expect(untilChosen([], [tile])).toBeCloseTo(1.5, 1);
  });

  it("chooses nothing with dwell off, or if the target can't be chosen", () => {
    expect(untilChosen([], [tile], false)).toBeNull();
    expect(untilChosen([], [target(null, 1)])).toBeNull();
  });

  it("chooses nothing while a hand points at a target, but chooses beside an idle hand", () => {
    expect(untilChosen([AHEAD], [tile])).toBeNull();
    expect(untilChosen([null], [tile])).not.toBeNull();
  });

  it("does not choose again the target that a button has chosen", () => {
    const pointer = new Pointer();
    pointer.advance(AHEAD, [], [tile], FRAME_S, true);
    if (pointer.gaze === null) throw new Error("nothing is hit");
    expect(pointer.press(pointer.gaze, [tile], 0)).toBe(true);
    for (let i = 0; i < 240; i++) {
      expect(pointer.advance(AHEAD, [], [tile], FRAME_S, true)).toBeNull();
    }
    expect(pointer.progress).toBe(0);
  });

  it("chooses nothing after a hand has chosen until the gaze has moved", () => {
    const pointer = new Pointer();
    const hand = { ...AHEAD, origin: new Vector3(0.2, 0, 0) };
    pointer.advance(AHEAD, [hand], [tile], FRAME_S, true);
    const [hit] = pointer.hands;
    if (hit === null) throw new Error("nothing is hit");
    pointer.press(hit, [tile], 0);
    for (let i = 0; i < 240; i++) {
      expect(pointer.advance(AHEAD, [null], [tile], FRAME_S, true)).toBeNull();
    }
    const aside = { ...AHEAD, direction: new Vector3(0.1, 0, -1).normalize() };
    const later = Array.from({ length: 120 }, () =>
      pointer.advance(aside, [null], [tile], FRAME_S, true),
    );
    expect(later.filter((each) => each !== null)).toHaveLength(1);
  });
});
