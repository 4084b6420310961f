import { Quaternion, Vector3 } from "three";
import { describe, expect, it } from "vitest";
import { poseAt } from "./flight";

const EYE = [0, 0, 2] as const;
const MIDDLE = [0, 0, 0] as const;
const SHARES = Array.from({ length: 201 }, (_, i) => i / 200);

describe("the flight", () => {
  it("begins and ends at the specimen's first pose", () => {
    for (const share of [0, 1, -1, 2]) {
      const { position, orientation, scale } = poseAt(share, EYE, MIDDLE);
      expect(new Vector3(...position).length()).toBeCloseTo(0, 12);
      expect(Math.abs(new Quaternion(...orientation).w)).toBeCloseTo(1, 12);
      expect(scale).toBe(1);
    }
  });

  it("turns the specimen once around without a jump, and moves it near and away again", () => {
    let turned = 0;
    let nearest = Number.POSITIVE_INFINITY;
    for (let i = 1; i < SHARES.length; i++) {
      const [a, b] = [poseAt(SHARES[i - 1], EYE, MIDDLE), poseAt(SHARES[i], EYE, MIDDLE)];
      const [qa, qb] = [new Quaternion(...a.orientation), new Quaternion(...b.orientation)];
      expect(qa.length()).toBeCloseTo(1, 12);
      expect(qa.angleTo(qb)).toBeLessThan(0.06);
      const front = (q: Quaternion) => new Vector3(0, 0, 1).applyQuaternion(q);
      turned += front(qa).angleTo(front(qb));
      const distance = new Vector3(...b.position).distanceTo(new Vector3(...EYE));
      expect(distance).toBeGreaterThan(1);
      nearest = Math.min(nearest, distance);
    }
    expect(turned).toBeGreaterThan(2 * Math.PI * 0.95);
    expect(nearest).toBeCloseTo(1.1, 2);
  });
});
