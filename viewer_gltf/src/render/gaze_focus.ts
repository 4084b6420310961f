/**
 * Follows the gaze frame by frame: which volumes are wanted, and how far the focus disc is open.
 */
import { Matrix4, Vector3 } from "three";
import type { Manifest } from "../bundle/generated/bundle";
import { shownTiles } from "../math/pick";
import {
  advanceFocus,
  discReach,
  FAR_AWAY,
  type FocusState,
  isWaiting,
} from "../state/focus_tiles";
import type { ViewerState } from "../state/viewer_state";

/** Seconds in which the disc opens once its volumes are loaded. */
const OPENING_S = 0.4;
/** Share of the outer radius within which no surface is drawn. */
const INNER = 0.6;
/** Seconds that the gaze must stay on the same tiles before finer mip levels are fetched. */
const REFINE_S = 0.25;

/** Radians. Largest half angle of a cone that is marched. */
const WIDEST_RAD = 1.5;

const RADIANS = Math.PI / 180;

export class GazeFocus {
  focusTiles: FocusState = FAR_AWAY;
  /** Share of the set radius that the frame's budget allows, 0 to 1. */
  radiusShare = 1;
  /** Outer radius of the disc, radians; 0: closed. */
  outer_rad = 0;
  /** Apex and axis of the disc's cone in the scene. */
  readonly apex = new Vector3();
  readonly axis = new Vector3(0, 0, -1);
  /** Apex and axis of the disc's cone in the specimen, um. */
  readonly apex_um = new Vector3();
  readonly axis_um = new Vector3(0, 0, -1);
  /**
   * How far the disc has opened, and how far it may open, radians; a frame's budget may show less.
   */
  private opened_rad = 0;
  private reach_rad = 0;
  private rested_s = 0;
  private readonly toSpecimen = new Matrix4();

  constructor(private readonly manifest: Manifest) {}

  get mayRefine(): boolean {
    return this.rested_s >= REFINE_S;
  }

  get cosines(): readonly [number, number] {
    return [Math.cos(INNER * this.outer_rad), Math.cos(this.outer_rad)];
  }

  /** Returns the cosine of the disc's outer radius plus `more_rad`; 1 if the disc is closed. */
  reach(more_rad: number): number {
    return this.outer_rad === 0 ? 1 : Math.cos(Math.min(WIDEST_RAD, this.outer_rad + more_rad));
  }

  /**
   * Updates the focus for a gaze along the head's -z axis. Returns whether other volumes may be
   * wanted than before.
   */
  look(
    state: ViewerState,
    head: Matrix4,
    specimen: Matrix4,
    isReady: (tile: string) => boolean,
    dt_s: number,
  ): boolean {
    this.apex.setFromMatrixPosition(head);
    this.axis.set(0, 0, -1).transformDirection(head);
    this.toSpecimen.copy(specimen).invert();
    this.apex_um.copy(this.apex).applyMatrix4(this.toSpecimen);
    this.axis_um.copy(this.axis).transformDirection(this.toSpecimen);
    const before = this.focusTiles;
    const couldRefine = this.mayRefine;
    const set_rad = state.discRadius_deg * RADIANS;
    this.focusTiles = advanceFocus(before, {
      gaze: { origin: this.apex_um.toArray(), direction: this.axis_um.toArray() },
      tiles: shownTiles(this.manifest.tiles, state.isolated),
      clip: state.clip,
      switchDistance_um: state.switchDistance_m / specimen.getMaxScaleOnAxis(),
      // The radius that the user has set is used here. With the smaller radius of a late frame,
      // tiles would come and go.
      discRadius_rad: set_rad,
      dt_s,
    });
    const isSame =
      before.focusTile === this.focusTiles.focusTile &&
      before.disc.join() === this.focusTiles.disc.join();
    this.rested_s = isSame ? this.rested_s + dt_s : 0;
    this.reach_rad = discReach(this.focusTiles, set_rad, isReady);
    const opened = this.opened_rad + (set_rad / OPENING_S) * dt_s;
    this.opened_rad = state.mode === "disc" ? Math.min(this.reach_rad, opened) : 0;
    this.outer_rad = Math.min(this.opened_rad, set_rad * this.radiusShare);
    return !isSame || couldRefine !== this.mayRefine;
  }

  /** Whether the next frame looks different although nothing moves. */
  isChanging(state: ViewerState): boolean {
    const isOpening = state.mode === "disc" && this.opened_rad < this.reach_rad;
    return isOpening || !this.mayRefine || isWaiting(this.focusTiles);
  }
}
