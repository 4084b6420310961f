/**
 * Keeps the view of the specimen between the screen and stereo. The part in the middle of the
 * screen is in front of the eyes in stereo, and vice versa.
 */
import { Euler, Quaternion, Vector3 } from "three";
import type { Navigation } from "../interaction/orbit_camera";
import { type HandPose, type SpecimenPose, zoomAbout } from "../math/grab";
import { ROOM_SIZE, XR_DISTANCE_M } from "../render/placement";
import { intoStereo, ontoScreen } from "../render/screen_to_stereo";
import type { Specimen } from "../render/specimen_pose";
import type { CameraView } from "../state/camera_view";

export class StereoTransition {
  /** Poses of the specimen in the scene and on the screen at the start of stereo; null: no stereo. */
  private entered: Readonly<{
    inStereo: SpecimenPose;
    onScreen: SpecimenPose | null;
    hold: HandPose;
    facing: Quaternion;
  }> | null = null;

  constructor(
    private readonly navigation: Navigation,
    private readonly specimen: Specimen,
  ) {}

  /**
   * Turns the side of the specimen that faces the screen to the head, with the middle of the view
   * straight ahead.
   *
   * @param larger factor to the specimen's size in stereo; has no effect if the user has moved or
   * resized the specimen
   * @param table upright place in the user's own room; null: in front of the eyes
   */
  enter(larger = 1, table: HandPose | null = null): void {
    const { navigation, specimen } = this;
    navigation.stopTurning();
    navigation.controls.enabled = false;
    const ahead_m = table?.position ?? new Vector3(0, 0, -XR_DISTANCE_M);
    const facing = table?.orientation ?? new Quaternion();
    const size = table === null ? 1 : ROOM_SIZE;
    const onScreen = this.poseOnScreen;
    const hold = table === null ? this.screenHold : levelled(this.screenHold);
    const pose = intoStereo(specimen.pose, hold, ahead_m, facing);
    specimen.anchorAt(ahead_m, size, facing);
    const sized = zoomAbout(pose, ahead_m, onScreen === null ? size * larger : size);
    const isOther = !navigation.isStraight || onScreen !== null || larger !== 1 || table !== null;
    if (isOther) specimen.moveTo(sized, new Vector3());
    this.entered = { inStereo: specimen.pose, onScreen, hold, facing };
  }

  /** Keeps the middle of the view when stereo ends. */
  leave(): void {
    const { navigation, specimen, poseOnScreen: pose } = this;
    this.entered = null;
    navigation.controls.enabled = true;
    specimen.anchorAt(new Vector3());
    if (pose !== null) specimen.moveTo(pose, navigation.camera.position);
  }

  /** The view of the specimen; null: the opening view. */
  get cameraView(): CameraView | null {
    const { navigation, poseOnScreen: pose } = this;
    const eye = pose === null ? navigation.look : navigation.cameraPose;
    if (eye === null || pose === null) return eye && { ...eye, specimen: null };
    const { position, orientation, scale } = pose;
    const specimen = { position: position.toArray(), orientation: orientation.toArray(), scale };
    return { ...eye, specimen };
  }

  /** Returns to an earlier `cameraView`. */
  restore(view: CameraView | null): void {
    this.specimen.goHome();
    if (view === null) this.navigation.reset();
    else this.lookFrom(view);
  }

  lookFrom({ position, target, specimen }: CameraView): void {
    this.navigation.lookFrom({ position, target });
    if (specimen === null) return;
    const pose = {
      position: new Vector3(...specimen.position),
      orientation: new Quaternion(...specimen.orientation),
      scale: specimen.scale,
    };
    this.specimen.moveTo(pose, this.navigation.camera.position);
  }

  /**
   * Pose of an imagined hand at the point that the flat camera turns around, with the camera's
   * orientation.
   */
  private get screenHold(): HandPose {
    const { target, object } = this.navigation.controls;
    return { position: target, orientation: object.quaternion };
  }

  /** Pose of the specimen for the flat camera, also in stereo; null: the opening pose. */
  private get poseOnScreen(): SpecimenPose | null {
    const { entered, navigation } = this;
    const { anchor, home, isMoved, pose } = this.specimen;
    if (entered === null) return isMoved ? pose : null;
    // the user has not moved the specimen in stereo
    if (pose === entered.inStereo) return entered.onScreen;
    if (!isMoved && navigation.isStraight) return null;
    const there = zoomAbout(isMoved ? pose : home, anchor, 1 / this.specimen.size);
    return ontoScreen(there, entered.hold, anchor, entered.facing);
  }
}

/** Returns a pose without its tilt, because an object on a table stands upright. */
function levelled({ position, orientation }: HandPose): HandPose {
  const { y } = new Euler().setFromQuaternion(orientation, "YXZ");
  return { position, orientation: new Quaternion().setFromEuler(new Euler(0, y, 0)) };
}
