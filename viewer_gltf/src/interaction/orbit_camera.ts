/**
 * The mono camera: it goes round the specimen by mouse, touch and key. One finger or the left button
 * turns, two fingers or the wheel zoom about the point that is looked at, two fingers or the right
 * button move. Nobody loses the specimen: the point that is looked at stays in its box, the eye
 * within limits of it.
 */
import { PerspectiveCamera, Spherical, Vector3 } from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { distanceToSee, framingDistance, type Placement } from "../render/placement";
import type { Command } from "../state/commands";

const FIELD_OF_VIEW_DEG = 40;
const NEAREST_M = 0.05;
const FARTHEST_M = 8;
/** Share of a glide that is left a second after the hand let go. */
const LEFT_AFTER_A_SECOND = 0.88 ** 60;
/** Turn by one key press, radians. */
const TURN_RAD = Math.PI / 12;
const ZOOM = 0.8;
/** Move by one key press, as a share of the picture's height. */
const PAN = 0.1;

/** Metres of the room. */
export type Look = Readonly<{
  position: readonly [number, number, number];
  target: readonly [number, number, number];
}>;

export class Navigation {
  readonly camera = new PerspectiveCamera(FIELD_OF_VIEW_DEG, 1, 0.01, 20);
  readonly controls: OrbitControls;
  /** Whether the start view still holds: then it follows the window's shape. */
  private isHome = true;
  private readonly reach: Vector3;

  constructor(
    canvas: HTMLElement,
    private readonly placement: Placement,
    onChange: () => void,
  ) {
    this.reach = new Vector3(...placement.size).multiplyScalar(0.5);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = true;
    this.controls.minDistance = NEAREST_M;
    this.controls.maxDistance = FARTHEST_M;
    this.controls.addEventListener("change", () => {
      this.stayWithin();
      onChange();
    });
    this.controls.addEventListener("start", () => {
      this.isHome = false;
    });
  }

  /** Go on with a glide, as long in seconds however few the frames; after so many of them. */
  update(dt_s: number): void {
    this.controls.dampingFactor = 1 - LEFT_AFTER_A_SECOND ** dt_s;
    this.controls.update();
    this.camera.updateMatrixWorld();
  }

  /** The window has this shape now. */
  fit(aspect: number): void {
    this.camera.aspect = aspect;
    this.camera.updateProjectionMatrix();
    if (this.isHome) this.reset();
  }

  /** The whole specimen from the front: x to the right, y up. */
  reset(): void {
    this.lookFrom({ position: [0, 0, this.framing(2)], target: [0, 0, 0] });
    this.isHome = true;
  }

  /** null: the start view, which follows the window's shape. */
  get look(): Look | null {
    return this.isHome ? null : this.lookNow;
  }

  get lookNow(): Look {
    return { position: this.camera.position.toArray(), target: this.controls.target.toArray() };
  }

  lookFrom({ position, target }: Look): void {
    this.isHome = false;
    this.controls.target.fromArray(target).clamp(this.reach.clone().negate(), this.reach);
    this.camera.position.fromArray(position);
    this.camera.up.set(0, 1, 0);
    this.controls.update();
  }

  /** Go straight back, as far as there is need, until these points of the room are in sight. */
  stepBackFor(points: readonly Vector3[]): void {
    const { target } = this.controls;
    const { position, quaternion, aspect } = this.camera;
    const turn = quaternion.clone().invert();
    const about = points.map((p) => p.clone().sub(target).applyQuaternion(turn).toArray());
    const needed = distanceToSee(about, (FIELD_OF_VIEW_DEG * Math.PI) / 180, aspect);
    const back = position.clone().sub(target);
    if (!(needed > back.length())) return;
    const eye = back.setLength(Math.min(FARTHEST_M, needed)).add(target);
    this.lookFrom({ position: eye.toArray(), target: target.toArray() });
  }

  /** Whether the command was one of the camera's. */
  run(command: Command): boolean {
    switch (command) {
      case "front":
        this.reset();
        return true;
      case "side":
        this.lookFrom({ position: [this.framing(0), 0, 0], target: [0, 0, 0] });
        return true;
      case "top":
        this.lookFrom({ position: [0, this.framing(1), 1e-4], target: [0, 0, 0] });
        return true;
      case "zoom-in":
        this.move(0, 0, ZOOM);
        return true;
      case "zoom-out":
        this.move(0, 0, 1 / ZOOM);
        return true;
      case "turn-left":
        this.move(-TURN_RAD, 0, 1);
        return true;
      case "turn-right":
        this.move(TURN_RAD, 0, 1);
        return true;
      case "turn-up":
        this.move(0, -TURN_RAD, 1);
        return true;
      case "turn-down":
        this.move(0, TURN_RAD, 1);
        return true;
      case "pan-left":
        this.pan(-1, 0);
        return true;
      case "pan-right":
        this.pan(1, 0);
        return true;
      case "pan-up":
        this.pan(0, 1);
        return true;
      case "pan-down":
        this.pan(0, -1);
        return true;
      default:
        return false;
    }
  }

  /** Bring the point that is looked at back into its box, and the eye along: the view is not turned. */
  private stayWithin(): void {
    const { target } = this.controls;
    const beyond = target.clone();
    target.clamp(this.reach.clone().negate(), this.reach);
    this.camera.position.add(target).sub(beyond);
  }

  private framing(axis: 0 | 1 | 2): number {
    const [x, y, z] = this.placement.size;
    const seen = (
      [
        [z, y, x],
        [x, z, y],
        [x, y, z],
      ] as const
    )[axis];
    return framingDistance(seen, (FIELD_OF_VIEW_DEG * Math.PI) / 180, this.camera.aspect);
  }

  private move(turn_rad: number, tilt_rad: number, zoom: number): void {
    const { target } = this.controls;
    const offset = this.camera.position.clone().sub(target);
    const at = new Spherical().setFromVector3(offset);
    at.theta += turn_rad;
    at.phi += tilt_rad;
    at.radius = Math.min(FARTHEST_M, Math.max(NEAREST_M, at.radius * zoom));
    at.makeSafe();
    this.lookFrom({
      position: offset.setFromSpherical(at).add(target).toArray(),
      target: target.toArray(),
    });
  }

  /** Steps to the right and up, as far as the point that is looked at may go. */
  private pan(right: number, up: number): void {
    const { target } = this.controls;
    const { position, quaternion } = this.camera;
    const height_m =
      2 * Math.tan((FIELD_OF_VIEW_DEG * Math.PI) / 360) * position.distanceTo(target);
    const to = new Vector3(right, up, 0)
      .applyQuaternion(quaternion)
      .multiplyScalar(PAN * height_m)
      .add(target)
      .clamp(this.reach.clone().negate(), this.reach);
    const from = position.clone().add(to).sub(target);
    this.lookFrom({ position: from.toArray(), target: to.toArray() });
  }

  dispose(): void {
    this.controls.dispose();
  }
}
