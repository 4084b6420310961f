/**
 * The camera of a flat screen, which orbits the specimen by mouse, touch and keys. One finger or
 * the left button turns. Two fingers or the wheel zoom about the point that is looked at. Two
 * fingers or the right button move. The specimen cannot get lost: the point that is looked at stays
 * in its box, and the eye stays within limits around it.
 */
import { PerspectiveCamera, Spherical, Vector3 } from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import type { Vec3 } from "../math/vec3";
import { distanceToSee, type Placement } from "../render/placement";
import type { Command } from "../state/commands";
import {
  type CameraPose,
  type Covered,
  FARTHEST_M,
  FIELD_OF_VIEW_DEG,
  type NamedView,
  NamedViews,
} from "./named_views";

const NEAREST_M = 0.05;
/** Share of a glide that is left one second after the hand has let go. */
const LEFT_AFTER_A_SECOND = 0.88 ** 60;
/** Radians that one key press turns. */
const TURN_RAD = Math.PI / 12;
/** Factor of the distance for one key press. */
const ZOOM = 0.8;
/** Seconds of a flight to a point. */
const FLIGHT_S = 0.4;
/** Motion by one key press, as a share of the image's height. */
const PAN = 0.1;

/** Metres. Largest difference between numbers of two cameras that count as equal. */
const SAME_M = 1e-4;

/** Whether the camera has not moved since `look` was read. */
export function isSameCameraPose(
  look: CameraPose,
  { cameraPose }: Pick<Navigation, "cameraPose">,
): boolean {
  const [was, is] = [look, cameraPose].map(({ position, target }) => [...position, ...target]);
  return was.every((v, i) => Math.abs(v - is[i]) < SAME_M);
}

const ACTS: Readonly<Partial<Record<Command, (navigation: Navigation) => void>>> = {
  front: (navigation) => navigation.showStill("front"),
  side: (navigation) => navigation.showStill("side"),
  top: (navigation) => navigation.showStill("top"),
  "zoom-in": (navigation) => navigation.move(0, 0, ZOOM),
  "zoom-out": (navigation) => navigation.move(0, 0, 1 / ZOOM),
  "turn-left": (navigation) => navigation.move(-TURN_RAD, 0, 1),
  "turn-right": (navigation) => navigation.move(TURN_RAD, 0, 1),
  "turn-up": (navigation) => navigation.move(0, -TURN_RAD, 1),
  "turn-down": (navigation) => navigation.move(0, TURN_RAD, 1),
  "pan-left": (navigation) => navigation.pan(-1, 0),
  "pan-right": (navigation) => navigation.pan(1, 0),
  "pan-up": (navigation) => navigation.pan(0, 1),
  "pan-down": (navigation) => navigation.pan(0, -1),
};

export class Navigation {
  readonly camera = new PerspectiveCamera(FIELD_OF_VIEW_DEG, 1, 0.01, 20);
  readonly controls: OrbitControls;
  private readonly views: NamedViews;
  private home: NamedView = "opening";
  /** The current named view; null after the user has moved. */
  private shownView: NamedView | null = "opening";
  /** Seconds since the opening's slow turn began; null if it does not turn. */
  private swayed_s: number | null = null;
  private flight: Readonly<{ from: CameraPose; to: CameraPose; elapsed_s: number }> | null = null;
  constructor(canvas: HTMLElement, placement: Placement, onChange: () => void) {
    this.views = new NamedViews(placement);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = true;
    this.controls.minDistance = NEAREST_M;
    this.controls.maxDistance = FARTHEST_M;
    this.controls.addEventListener("change", () => {
      this.stayWithin();
      onChange();
    });
    this.controls.addEventListener("start", () => {
      this.shownView = null;
      this.flight = null;
    });
  }

  /** Advances glides, flights and the slow turn; they take the same time at any frame rate. */
  update(dt_s: number): void {
    this.fly(dt_s);
    if (this.swayed_s !== null) {
      this.swayed_s += dt_s;
      this.showNamedView("opening");
    }
    this.controls.dampingFactor = 1 - LEFT_AFTER_A_SECOND ** dt_s;
    this.controls.update();
    this.camera.updateMatrixWorld();
  }

  fit(aspect: number, covered: Covered = { top: 0, bottom: 0 }): void {
    this.views.fit(aspect, covered);
    this.camera.aspect = aspect;
    this.camera.updateProjectionMatrix();
    if (this.shownView !== null) this.showNamedView(this.shownView);
  }

  /** Returns to the view with which the page opens, which shows the whole specimen. */
  reset(): void {
    this.stopTurning();
    this.showNamedView(this.home);
  }

  /** Opens with another view than the default. */
  openAt(view: NamedView): void {
    this.home = view;
    this.reset();
  }

  /**
   * Sets the outermost points of the occupied part of the specimen, um, on which the opening is
   * framed.
   */
  setOccupied(points: readonly Vec3[]): void {
    this.views.setOccupied(points);
    if (this.shownView !== null) this.showNamedView(this.shownView);
  }

  /** Converts points of the specimen, um, to the scene, metres, as a flat screen shows it. */
  toScene(points: readonly Vec3[]): readonly Vec3[] {
    return this.views.toScene(points);
  }

  /** Largest distance of the eye from the middle during the opening's slow turn. */
  get openingDistance_m(): number {
    return this.views.openingDistance_m;
  }

  /** Swings slowly until the user moves, if the opening is shown. */
  turnSlowly(): void {
    if (this.shownView === "opening") this.swayed_s = 0;
  }

  /** Stops the slow turn and keeps the view where it is. */
  stopTurning(): void {
    if (this.swayed_s === null) return;
    this.swayed_s = null;
    this.shownView = null;
  }

  get isTurning(): boolean {
    return this.swayed_s !== null;
  }

  /** The camera; null while it shows the opening at rest, which follows the window's shape. */
  get look(): CameraPose | null {
    return this.shownView === "opening" && !this.isTurning ? null : this.cameraPose;
  }

  /** The current named view; null after the user has moved. */
  get namedView(): NamedView | null {
    return this.shownView;
  }

  /** Whether the specimen is seen straight from the front. */
  get isStraight(): boolean {
    return this.shownView === "front";
  }

  get cameraPose(): CameraPose {
    return { position: this.camera.position.toArray(), target: this.controls.target.toArray() };
  }

  lookFrom({ position, target }: CameraPose): void {
    this.shownView = null;
    this.swayed_s = null;
    this.flight = null;
    this.place({ position, target });
  }

  /** Flies half-way towards a point of the scene, so that it comes into the middle. */
  flyTowards(point: Vector3): void {
    const { position } = this.camera;
    const away = position.clone().sub(point);
    const eye = away.setLength(Math.max(NEAREST_M, away.length() / 2)).add(point);
    const to = { position: eye.toArray(), target: point.toArray() };
    this.stopTurning();
    this.shownView = null;
    if (matchMedia("(prefers-reduced-motion: reduce)").matches) this.place(to);
    else this.flight = { from: this.cameraPose, to, elapsed_s: 0 };
  }

  private fly(dt_s: number): void {
    if (this.flight === null) return;
    const { from, to } = this.flight;
    const elapsed_s = this.flight.elapsed_s + dt_s;
    const part = Math.min(1, elapsed_s / FLIGHT_S);
    const share = part * part * (3 - 2 * part); // starts and ends slowly
    const between = (a: Vec3, b: Vec3) =>
      new Vector3(...a).lerp(new Vector3(...b), share).toArray() as Vec3;
    this.place({
      position: between(from.position, to.position),
      target: between(from.target, to.target),
    });
    this.flight = part < 1 ? { from, to, elapsed_s } : null;
  }

  get isFlying(): boolean {
    return this.flight !== null;
  }

  private place({ position, target }: CameraPose): void {
    this.controls.target
      .fromArray(target)
      .clamp(this.views.reach.clone().negate(), this.views.reach);
    this.camera.position.fromArray(position);
    this.camera.up.set(0, 1, 0);
    this.controls.update();
  }

  /** Moves straight back as far as needed until these points of the scene are in view. */
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

  /** Runs a command. Returns false if it is not one of the camera's. */
  run(command: Command): boolean {
    const act = ACTS[command];
    act?.(this);
    return act !== undefined;
  }

  /**
   * Moves the point that is looked at back into its box, and the eye by the same vector, so that
   * the view does not turn.
   */
  private stayWithin(): void {
    const { target } = this.controls;
    const beyond = target.clone();
    target.clamp(this.views.reach.clone().negate(), this.views.reach);
    this.camera.position.add(target).sub(beyond);
  }

  /** Shows the specimen from a named view without the slow turn. */
  showStill(view: NamedView): void {
    this.swayed_s = null;
    this.showNamedView(view);
  }

  private showNamedView(view: NamedView): void {
    this.place(this.views.lookAt(view, this.swayed_s ?? 0));
    this.shownView = view;
  }

  /** Turns about the point that is looked at, and multiplies the distance from it by `zoom`. */
  move(turn_rad: number, tilt_rad: number, zoom: number): void {
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

  /** Shifts by steps to the right and up, as far as the point that is looked at may go. */
  pan(right: number, up: number): void {
    const { target } = this.controls;
    const { position, quaternion } = this.camera;
    const height_m =
      2 * Math.tan((FIELD_OF_VIEW_DEG * Math.PI) / 360) * position.distanceTo(target);
    const to = new Vector3(right, up, 0)
      .applyQuaternion(quaternion)
      .multiplyScalar(PAN * height_m)
      .add(target)
      .clamp(this.views.reach.clone().negate(), this.views.reach);
    const from = position.clone().add(to).sub(target);
    this.lookFrom({ position: from.toArray(), target: to.toArray() });
  }

  dispose(): void {
    this.controls.dispose();
  }
}
