/** The viewpoint: the flat camera, the head in stereo, and the pose of the specimen. */
import { type Matrix4, Quaternion, type Vector2, Vector3 } from "three";
import type { Bounds } from "../bundle/generated/bundle";
import type { CameraPose, NamedView } from "../interaction/named_views";
import { isSameCameraPose, Navigation } from "../interaction/orbit_camera";
import { rayAhead, rayUnder } from "../interaction/rays";
import { type Box, centerOf } from "../math/box";
import { type HandPose, zoomAbout } from "../math/grab";
import type { Ray, Vec3 } from "../math/vec3";
import {
  OVER_FLOOR_M,
  place,
  ROOM_DISTANCE_M,
  ROOM_SIZE,
  UNDER_EYES_M,
  XR_DISTANCE_M,
} from "../render/placement";
import type { Specimen } from "../render/specimen_pose";
import type { CameraView } from "../state/camera_view";
import { START_TOOLS } from "../state/parameters/tools";
import { ahead } from "../xr/head_pose";
import type { Stereo } from "../xr/stereo";
import { StereoTransition } from "./stereo_transition";

/** Distance of the eye from an object that it flies to, as a multiple of the object's length. */
const NEAREST_OBJECT = 6;
/** Smallest distance of the eye from an object that it flies to, m. */
const NEAREST_OBJECT_M = 0.08;
/** Directions from which to view an object: corners, edges and faces of a cube, from the front first. */
const VIEW_DIRECTIONS = [1, 0, -1].flatMap((z) =>
  [0, 1, -1].flatMap((y) => [0, 1, -1].flatMap((x) => (x || y || z ? [[x, y, z] as const] : []))),
);
/** Smallest length of an object that is brought in front of the eyes in stereo, m. */
const OBJECT_IN_STEREO_M = 0.15;

export type ViewpointOptions = Readonly<{
  canvas: HTMLCanvasElement;
  /** Box of the specimen, um. */
  bounds: Bounds;
  specimen: Specimen;
  /** Made after the viewpoint. */
  stereo: () => Stereo;
  /** Called when the view has to be drawn again at once. */
  onChange: () => void;
}>;

export class Viewpoint {
  readonly navigation: Navigation;
  private readonly transition: StereoTransition;

  constructor(private readonly options: ViewpointOptions) {
    const { canvas, bounds, specimen, onChange } = options;
    this.navigation = new Navigation(canvas, place(bounds), onChange);
    this.transition = new StereoTransition(this.navigation, specimen);
  }

  /** Pose of the head or of the flat camera, in the scene. */
  get head(): Matrix4 {
    return this.options.stereo().head ?? this.navigation.camera.matrixWorld;
  }

  /** Matrix from um to metres of the scene. */
  get specimen(): Matrix4 {
    return this.options.specimen.group.matrixWorld;
  }

  /** The view of the specimen; null: the opening view. */
  get cameraView(): CameraView | null {
    return this.transition.cameraView;
  }

  /** The present view of the specimen, also if it is the opening view. */
  get viewNow(): CameraView {
    return this.cameraView ?? { ...this.navigation.cameraPose, specimen: null };
  }

  lookFrom(view: CameraView): void {
    this.transition.lookFrom(view);
    this.options.onChange();
  }

  /** Pose of the flat camera, in metres of the scene. */
  get cameraPose(): CameraPose {
    return this.navigation.cameraPose;
  }

  /** Places the flat camera without moving the specimen. */
  lookFlatFrom(look: CameraPose): void {
    this.navigation.lookFrom(look);
    this.options.onChange();
  }

  /** Returns whether the flat camera is at a given pose. */
  isAt(look: CameraPose): boolean {
    return isSameCameraPose(look, this.navigation);
  }

  /**
   * The named view in which the camera is now, such as "front"; null: the user has moved the
   * camera.
   */
  get standing(): NamedView | null {
    return this.navigation.namedView;
  }

  /** Distance from the eye to the middle of the specimen in the opening view, m. */
  get openingDistance_m(): number {
    return this.navigation.openingDistance_m;
  }

  /** Turns the specimen slowly to and fro, until the user moves it or the opening view is left. */
  turnSlowly(): void {
    this.navigation.turnSlowly();
    this.options.onChange();
  }

  /** Projects a point (um) into the flat view: x and y in -1..1, and the depth. */
  project(point: Vec3): Vector3 {
    return new Vector3(...point).applyMatrix4(this.specimen).project(this.navigation.camera);
  }

  /** Converts a point from um to metres of the scene. */
  toScene(point: Vec3): Vec3 {
    return new Vector3(...point).applyMatrix4(this.specimen).toArray();
  }

  /** Converts a point from metres of the scene to um. */
  toSpecimen(place: Vec3): Vec3 {
    const toSpecimen = this.specimen.clone().invert();
    return new Vector3(...place).applyMatrix4(toSpecimen).toArray();
  }

  /** Returns to an earlier `cameraView`. */
  restore(view: CameraView | null): void {
    this.transition.restore(view);
    this.options.onChange();
  }

  /** Opens with a named view, or with the opening view of the specimen. */
  openAt(stand: NamedView): void {
    this.navigation.openAt(stand);
    this.options.onChange();
  }

  /** Stops the slow turning after the user has touched the page. */
  stopTurning(): void {
    this.navigation.stopTurning();
  }

  /** Returns the ray (um) under a point of the view, -1..1. */
  rayAt(point: Vector2): Ray {
    return rayUnder(point, this.navigation.camera, this.options.specimen.group);
  }

  /** The ray (um) straight ahead. */
  get rayAhead(): Ray {
    return rayAhead(this.head, this.options.specimen.group);
  }

  /** Moves the camera back until points (um) are in the view. */
  stepBackFor(points: readonly Vec3[]): void {
    this.navigation.stepBackFor(
      points.map((point) => new Vector3(...point).applyMatrix4(this.specimen)),
    );
  }

  /** Flies towards a point, um. */
  flyTowards(point: Vec3): void {
    this.navigation.flyTowards(new Vector3(...point).applyMatrix4(this.specimen));
    this.options.onChange();
  }

  /**
   * Moves the specimen back to its opening position: in stereo straight in front of the head, at
   * its height.
   */
  recentre(): void {
    const { specimen } = this.options;
    const stereo = this.options.stereo();
    const head = stereo.recentre();
    if (head === null) specimen.goHome();
    else if (stereo.isInUsersRoom) {
      const { position, orientation } = this.tableBefore(head);
      specimen.anchorAt(position, ROOM_SIZE, orientation);
    } else specimen.anchorAt(ahead(head, XR_DISTANCE_M));
    this.navigation.reset();
  }

  /** @param size_m length of the specimen's longest edge in stereo */
  enterStereo(size_m: number): void {
    const { isInUsersRoom, head } = this.options.stereo();
    const table = isInUsersRoom && head !== null ? this.tableBefore(head) : null;
    const { specimen } = this.options;
    this.transition.enter(size_m / START_TOOLS.specimenSize_m, table);
    specimen.isJumping = true;
    specimen.takeJump(); // there is no earlier frame to fade from
  }

  leaveStereo(): void {
    this.options.specimen.isJumping = false;
    this.transition.leave();
  }

  /**
   * Brings an object near. The flat camera flies to a place where nothing hides the object, if
   * there is one. In stereo the object moves in front of the eyes. Returns whether nothing hides
   * it.
   *
   * @param isSeen returns whether an eye (um) sees the object
   */
  flyTo(box: Box, isSeen: (eye: Vec3) => boolean): boolean {
    const { specimen } = this.options;
    const middle = new Vector3(...centerOf(box)).applyMatrix4(this.specimen);
    const edge_m = specimen.scale * Math.max(...box.max.map((v, i) => v - box.min[i]));
    this.options.onChange();
    if (this.options.stereo().kind === null) return this.flyOnScreen(middle, edge_m, isSeen);
    const larger = Math.max(1, OBJECT_IN_STEREO_M / edge_m);
    const pose = zoomAbout(specimen.pose, middle, larger);
    pose.position.add(specimen.anchor).sub(middle);
    specimen.jumpTo(pose, new Vector3().setFromMatrixPosition(this.head));
    return true;
  }

  private flyOnScreen(middle: Vector3, edge_m: number, isSeen: (eye: Vec3) => boolean): boolean {
    const toSpecimen = this.specimen.clone().invert();
    const { position, target } = this.navigation.cameraPose;
    const distance_m = Math.max(NEAREST_OBJECT * edge_m, NEAREST_OBJECT_M);
    const now = new Vector3(...position).sub(new Vector3(...target));
    const eyes = [now, ...VIEW_DIRECTIONS.map((way) => new Vector3(...way))].map((way) =>
      way.setLength(distance_m).add(middle),
    );
    const free = eyes.find((eye) => isSeen(eye.clone().applyMatrix4(toSpecimen).toArray()));
    const { x, y, z } = free ?? eyes[0];
    this.navigation.lookFrom({ position: [x, y, z], target: middle.toArray() });
    return free !== undefined;
  }

  /** Returns the place for the specimen in the user's own room, facing the head. */
  private tableBefore(head: Matrix4): HandPose {
    const position = ahead(head, ROOM_DISTANCE_M);
    const eye = new Vector3().setFromMatrixPosition(head);
    const heading = Math.atan2(eye.x - position.x, eye.z - position.z);
    const { hasFloor } = this.options.stereo().headset;
    const height_m = hasFloor ? OVER_FLOOR_M : eye.y - UNDER_EYES_M;
    const orientation = new Quaternion().setFromAxisAngle(new Vector3(0, 1, 0), heading);
    return { position: position.setY(height_m), orientation };
  }

  dispose(): void {
    this.navigation.dispose();
  }
}
