/**
 * Moves the specimen in stereo: by commands, fingers, sticks and hands, or with the gaze or the
 * head.
 */
import type { Vector3 } from "three";
import type { SceneRay } from "../interaction/ray_pointer";
import { type SpecimenPose, zoomAbout } from "../math/grab";
import { type BoxedTile, shownTiles } from "../math/pick";
import type { Specimen } from "../render/specimen_pose";
import type { Command } from "../state/commands";
import type { ViewerState } from "../state/viewer_state";
import { type HeadHold, isFacing, moveByCommand, moveByFingers } from "./hold_specimen";
import { hullOf, middleOf } from "./shown_hull";

type Move = Parameters<typeof moveByFingers>[1];

export class SpecimenMover {
  constructor(
    private readonly specimen: Specimen,
    private readonly tiles: readonly BoxedTile[],
  ) {}

  get pose(): SpecimenPose {
    return this.specimen.pose;
  }

  /** Middle of the shown tiles, in the scene. */
  middle({ isolated }: ViewerState): Vector3 {
    return middleOf(hullOf(shownTiles(this.tiles, isolated), this.specimen.group.matrixWorld));
  }

  /**
   * Moves the specimen to a pose, as seen from `eye`. Returns false if it has this pose already.
   */
  moveTo(pose: SpecimenPose, eye: Vector3): boolean {
    if (pose === this.pose) return false;
    this.specimen.moveTo(pose, eye);
    return true;
  }

  /** Returns to an earlier pose at once, without motion. */
  jumpTo(pose: SpecimenPose, eye: Vector3): void {
    this.specimen.jumpTo(pose, eye);
  }

  /** Moves the specimen by a share of a command's step. Returns false if the command moves nothing. */
  run(command: Command, state: ViewerState, eye: Vector3, share: number): boolean {
    const pose = moveByCommand(this.pose, command, this.middle(state), eye, share);
    if (pose === null) return false;
    if (isFacing(command)) this.specimen.jumpTo(pose, eye);
    else this.specimen.moveTo(pose, eye);
    return true;
  }

  resize(factor: number, state: ViewerState, eye: Vector3): void {
    this.specimen.moveTo(zoomAbout(this.pose, this.middle(state), factor), eye);
  }

  byFingers(gesture: Move, state: ViewerState, eye: Vector3): void {
    this.specimen.moveTo(moveByFingers(this.pose, gesture, this.middle(state), eye), eye);
  }

  /** State of a gaze or head that starts to hold the specimen now. */
  holdBy(gaze: SceneRay, state: ViewerState): HeadHold {
    return { pose: this.pose, pivot: this.middle(state), gaze };
  }
}
