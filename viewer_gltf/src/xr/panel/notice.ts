/**
 * A notice in stereo: a label under the place that the head looks at when it comes. It stays
 * there in the room, since a label that moves with the head makes sick, and goes by itself.
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

/** Distance from the head, m: mostly before the specimen, and not so near that eyes cross. */
export const NOTICE_DISTANCE_M = 0.9;
/** Render order: over volumes, marks and a specimen that is held closer; under the ring. */
const RENDER_ORDER = 1900;

export class RoomNotice {
  private readonly quad: CanvasQuad;
  private announcements: Announcements = NO_ANNOUNCEMENTS;
  /** It comes with the next frame, which knows where the head looks. */
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

  /** The texts that can be read now. */
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
   * Once a frame; whether it looks otherwise than before.
   *
   * @param rows the middle of the upper edge of the open menu's rows, over which a notice is laid if the gaze is not
   *   far below it; null: the menu is closed
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
