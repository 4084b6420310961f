import { Matrix4, Vector3 } from "three";
import { describe, expect, it } from "vitest";
import { REFUSED } from "../../state/refusals";
import { StereoNotice } from "./notice";
import { NOTICE_HEIGHT, NOTICE_PX_PER_M, NOTICE_WIDTH, textsHeight } from "./notice_queue";
import { bearingOf, PANEL_DISTANCE_M, pointAt } from "./placement";

const DEG = Math.PI / 180;
const EYE = new Vector3(0.1, 1.6, 0.2);
const LONG = REFUSED.near;

/** A head at EYE with this pitch. */
const headAt = (pitch_deg: number) => new Matrix4().makeRotationX(pitch_deg * DEG).setPosition(EYE);

/**
 * Pitch of the lower end of a notice's texts at the left, in the middle and at the right, degrees.
 */
function lowerEnd({ mesh, texts }: StereoNotice): readonly number[] {
  const y = NOTICE_HEIGHT / 2 - textsHeight(texts);
  return [-0.5, 0, 0.5].map((across) => {
    const end = new Vector3(across * NOTICE_WIDTH, y, 0).divideScalar(NOTICE_PX_PER_M);
    return bearingOf(mesh.localToWorld(end).sub(EYE)).pitch / DEG;
  });
}

describe("a notice while the menu is open", () => {
  it.each([["Saved."], [LONG], ["Saved.", LONG]])(
    "does not cover the menu's rows: %s",
    (...texts) => {
      for (const top_deg of [-12, 31]) {
        const rows = pointAt({ yaw: 0, pitch: top_deg * DEG }, EYE, PANEL_DISTANCE_M);
        for (const gaze_deg of [top_deg - 8, top_deg - 24]) {
          const notice = new StereoNotice(false);
          for (const text of texts) notice.announce(text);
          notice.update(0.1, headAt(gaze_deg), rows.clone());
          expect(notice.texts).toEqual(texts);
          const ends = lowerEnd(notice);
          expect(ends[1]).toBeGreaterThan(top_deg);
          // seen high up, the edges of notice and menu are lower at the sides than in the middle
          if (top_deg < 0) expect(Math.min(...ends)).toBeGreaterThan(top_deg);
          expect(ends[1]).toBeLessThan(top_deg + 1);
          expect(notice.mesh.visible).toBe(true);
        }
      }
    },
  );

  it("lies below the gaze if the menu's upper edge is far above the gaze", () => {
    const notice = new StereoNotice(false);
    notice.announce("Saved.");
    const rows = pointAt({ yaw: 0, pitch: 31 * DEG }, EYE, PANEL_DISTANCE_M);
    notice.update(0.1, headAt(-10), rows);
    expect(bearingOf(notice.mesh.position.clone().sub(EYE)).pitch / DEG).toBeCloseTo(-30);
  });

  it("lies below the gaze if no menu is open", () => {
    const notice = new StereoNotice(false);
    notice.announce("Saved.");
    notice.update(0.1, headAt(-10));
    expect(bearingOf(notice.mesh.position.clone().sub(EYE)).pitch / DEG).toBeCloseTo(-30);
  });
});
