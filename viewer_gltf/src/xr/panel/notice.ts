/**
 * A notice in stereo: a label below the place at which the head looks when it appears. The label
 * stays there in the scene, since a label that moves with the head causes sickness, and disappears
 * by itself.
 */
import { type Matrix4, Vector3 } from "three";
import { CanvasQuad } from "./canvas_quad";
import {
  type Announcements,
  advanceAnnouncements,
  announce,
  NO_ANNOUNCEMENTS,
  NOTICE_HEIGHT,
  NOTICE_PX_PER_M,
  NOTICE_WIDTH,
  noticeMarks,
  textsHeight,
} from "./notice_queue";
import {
  type Bearing,
  bearingOf,
  headBearing,
  isNear,
  noticeAbove,
  noticeBearing,
  pointAt,
} from "./placement";

/**
 * Metres from the head: usually in front of the specimen, but far enough for comfortable
 * convergence.
 */
export const NOTICE_DISTANCE_M = 0.9;
/** Draw order: after volumes, marks and a specimen that is held closer, before the dwell ring. */
const RENDER_ORDER = 1900;

export class StereoNotice {
  private readonly quad: CanvasQuad;
  private announcements: Announcements = NO_ANNOUNCEMENTS;
  /** True until the next frame, which knows where the head looks and places the notice. */
  private wantsPlace = false;

  /** @param isPainted false: nothing is painted, as in a test without a browser */
  constructor(isPainted = true) {
    const context = isPainted ? undefined : null;
    this.quad = new CanvasQuad(NOTICE_WIDTH, NOTICE_HEIGHT, context, NOTICE_PX_PER_M);
    this.quad.drawOver(RENDER_ORDER);
    this.quad.mesh.name = "notice";
  }

  get mesh() {
    return this.quad.mesh;
  }

  get texts(): readonly string[] {
    return this.announcements.texts;
  }

  announce(text: string): void {
    this.announcements = announce(this.announcements, text);
    this.wantsPlace = true;
  }

  clear(): void {
    this.announcements = NO_ANNOUNCEMENTS;
    this.wantsPlace = false;
    this.mesh.visible = false;
  }

  /**
   * Updates the notice for one frame. Returns whether it looks different from the last frame.
   *
   * @param rows middle of the upper edge of the open menu's rows; the notice lies above it unless
   *   the gaze is far below; null: the menu is closed
   */
  update(dt_s: number, head: Matrix4, rows: Vector3 | null = null): boolean {
    const wasShown = this.mesh.visible;
    if (this.wantsPlace) {
      this.wantsPlace = false;
      const eye = new Vector3().setFromMatrixPosition(head);
      this.quad.place(
        pointAt(this.bearing(headBearing(head), rows?.sub(eye)), eye, NOTICE_DISTANCE_M),
        eye,
      );
    } else this.announcements = advanceAnnouncements(this.announcements, dt_s);
    this.mesh.visible = this.texts.length > 0;
    if (!this.mesh.visible) return wasShown;
    return this.quad.show(noticeMarks(this.texts)) || !wasShown;
  }

  private bearing(gaze: Bearing, rows?: Vector3): Bearing {
    if (rows === undefined || !isNear(bearingOf(rows), gaze)) return noticeBearing(gaze);
    const end_px = NOTICE_HEIGHT / 2 - textsHeight(this.texts);
    return noticeAbove(bearingOf(rows), Math.atan(end_px / NOTICE_PX_PER_M / NOTICE_DISTANCE_M));
  }

  dispose(): void {
    this.quad.dispose();
  }
}
