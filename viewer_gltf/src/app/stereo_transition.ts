/**
 * From where the specimen is seen, on the screen and in stereo: what was looked at on the one is
 * looked at in the other, and back.
 */
import { Quaternion, Vector3 } from "three";
import type { Navigation } from "../interaction/orbit_camera";
import { type HandPose, type SpecimenPose, zoomAbout } from "../math/grab";
import { XR_DISTANCE_M } from "../render/placement";
import { intoRoom, ontoScreen } from "../render/screen_to_room";
import type { Specimen } from "../render/specimen_pose";
import type { CameraView } from "../share/camera_link";

export class StereoTransition {
  /** In stereo: where the specimen was when it began, in the room and on the screen. */
  private entered: Readonly<{ inRoom: SpecimenPose; onScreen: SpecimenPose | null }> | null = null;

  constructor(
    private readonly navigation: Navigation,
    private readonly specimen: Specimen,
  ) {}

  /**
   * The specimen turns the same side to the head as to the screen, what was looked at ahead.
   *
   * @param larger than it opens, unless someone has made it as large as it is
   */
  enter(larger = 1): void {
    const { navigation, specimen } = this;
    navigation.stopTurning();
    navigation.controls.enabled = false;
    const ahead_m = new Vector3(0, 0, -XR_DISTANCE_M);
    const onScreen = this.poseOnScreen;
    const pose = intoRoom(specimen.pose, this.screenHold, ahead_m);
    specimen.anchorAt(ahead_m);
    const sized = onScreen === null ? zoomAbout(pose, ahead_m, larger) : pose;
    const isOther = !navigation.isStraight || onScreen !== null || larger !== 1;
    if (isOther) specimen.moveTo(sized, new Vector3());
    this.entered = { inRoom: specimen.pose, onScreen };
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
    const eye = pose === null ? navigation.look : navigation.lookNow;
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
    return ontoScreen(isMoved ? pose : home, this.screenHold, anchor);
  }
}
