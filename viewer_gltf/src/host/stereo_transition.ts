/**
 * From where the specimen is seen, on the screen and in stereo: what was looked at on the one is
 * looked at in the other, and back.
 */
import { Euler, Quaternion, Vector3 } from "three";
import type { Navigation } from "../interaction/orbit_camera";
import { type HandPose, type SpecimenPose, zoomAbout } from "../math/grab";
import { ROOM_SIZE, XR_DISTANCE_M } from "../render/placement";
import { intoRoom, ontoScreen } from "../render/screen_to_room";
import type { Specimen } from "../render/specimen_pose";
import type { CameraView } from "../state/camera_view";

export class StereoTransition {
  /** In stereo: where the specimen was when it began, in the room and on the screen. */
  private entered: Readonly<{
    inRoom: SpecimenPose;
    onScreen: SpecimenPose | null;
    hold: HandPose;
    facing: Quaternion;
  }> | null = null;

  constructor(
    private readonly navigation: Navigation,
    private readonly specimen: Specimen,
  ) {}

  /**
   * The specimen turns the same side to the head as to the screen, what was looked at ahead.
   *
   * @param larger than it opens, unless someone has made it as large as it is
   * @param table where it stands in the user's own room, upright; null: before the eyes
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
    const pose = intoRoom(specimen.pose, hold, ahead_m, facing);
    specimen.anchorAt(ahead_m, size, facing);
    const sized = zoomAbout(pose, ahead_m, onScreen === null ? size * larger : size);
    const isOther = !navigation.isStraight || onScreen !== null || larger !== 1 || table !== null;
    if (isOther) specimen.moveTo(sized, new Vector3());
    this.entered = { inRoom: specimen.pose, onScreen, hold, facing };
  }

  /** What was looked at stays. */
  leave(): void {
    const { navigation, specimen, poseOnScreen: pose } = this;
    this.entered = null;
    navigation.controls.enabled = true;
    specimen.anchorAt(new Vector3());
    if (pose !== null) specimen.moveTo(pose, navigation.camera.position);
  }

  /** From where the specimen is seen; null: as it opens. */
  get cameraView(): CameraView | null {
    const { navigation, poseOnScreen: pose } = this;
    const eye = pose === null ? navigation.look : navigation.cameraPose;
    if (eye === null || pose === null) return eye && { ...eye, specimen: null };
    const { position, orientation, scale } = pose;
    const specimen = { position: position.toArray(), orientation: orientation.toArray(), scale };
    return { ...eye, specimen };
  }

  /** Back to where `cameraView` was. */
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

  /** The flat camera, held as a hand holds a thing: by the point that it is turned about. */
  private get screenHold(): HandPose {
    const { target, object } = this.navigation.controls;
    return { position: target, orientation: object.quaternion };
  }

  /** Where the specimen is to the flat camera, also while there is stereo; null: where it opens. */
  private get poseOnScreen(): SpecimenPose | null {
    const { entered, navigation } = this;
    const { anchor, home, isMoved, pose } = this.specimen;
    if (entered === null) return isMoved ? pose : null;
    if (pose === entered.inRoom) return entered.onScreen; // nobody has moved it there
    if (!isMoved && navigation.isStraight) return null;
    const there = zoomAbout(isMoved ? pose : home, anchor, 1 / this.specimen.size);
    return ontoScreen(there, entered.hold, anchor, entered.facing);
  }
}

/** The same without its tilt: a thing on a table stands upright. */
function levelled({ position, orientation }: HandPose): HandPose {
  const { y } = new Euler().setFromQuaternion(orientation, "YXZ");
  return { position, orientation: new Quaternion().setFromEuler(new Euler(0, y, 0)) };
}
