/**
 * Pose of the specimen in the scene: at home, with one tile in the middle, or where hands put it.
 */
import { Group, Matrix4, Quaternion, Vector3 } from "three";
import type { Manifest } from "../bundle/generated/bundle";
import { limitPlacement, poseMatrix, type SpecimenPose } from "../math/grab";
import { LONGEST_EDGE_M, place } from "./placement";

type Bounds = Manifest["specimen"]["bounds_um"];

/** Seconds of a move that no hand makes, slow enough for the eyes to follow. */
export const MOVE_S = 0.4;
/** Metres. Farthest distance of a carried specimen, so that it stays in view. */
const FARTHEST_M = 5;

export class Specimen {
  /** The specimen in the scene; the coordinates of its children are in um of the world. */
  readonly group = new Group();
  pose: SpecimenPose;
  isMoved = false;
  private goal: SpecimenPose;
  private start: SpecimenPose;
  /** Progress from start to goal, 0 to 1. */
  private way = 1;
  /** Where the middle of the shown part is in the scene until somebody moves it. */
  readonly anchor = new Vector3();
  /** Present size of the specimen, as a factor of its initial size. */
  size = 1;
  /** Whether moves are jumps, as in stereo, where gliding causes sickness. The frame then fades. */
  isJumping = false;
  private hasJumped = false;
  private readonly facing = new Quaternion();
  private readonly base: Matrix4;
  private focus: Bounds | null = null;

  constructor(private readonly bounds: Bounds) {
    const { scale, center } = place(bounds);
    this.base = new Matrix4()
      .makeScale(scale, scale, scale)
      .multiply(new Matrix4().makeTranslation(-center[0], -center[1], -center[2]));
    this.pose = this.goal = this.start = this.home;
    this.group.matrixAutoUpdate = false;
    this.apply();
  }

  /** Middle of the specimen in the scene, metres. */
  get middle(): [number, number, number] {
    const [x, y, z] = place(this.bounds).center;
    return new Vector3(x, y, z).applyMatrix4(this.group.matrixWorld).toArray();
  }

  /** Metres of the scene per um. */
  get scale(): number {
    return this.group.matrixWorld.getMaxScaleOnAxis();
  }

  /**
   * Puts the middle of the shown part at a point of the scene, at once.
   *
   * @param size factor of its initial size
   * @param facing orientation whose z axis the specimen's front points along
   */
  anchorAt(point: Vector3, size = 1, facing = new Quaternion()): void {
    this.anchor.copy(point);
    this.facing.copy(facing);
    this.size = size;
    this.goHome();
  }

  /**
   * Brings a tile to the middle, as large as fits in the whole specimen's place; null: the whole
   * specimen again.
   */
  show(tile: Bounds | null): void {
    if (tile === this.focus) return;
    this.focus = tile;
    if (this.isJumping) {
      this.goHome();
      return;
    }
    this.isMoved = false;
    this.start = this.pose;
    this.goal = this.home;
    this.way = 0;
  }

  /** The pose of the specimen until a user moves it. */
  get home(): SpecimenPose {
    const orientation = this.facing.clone();
    const { focus, size } = this;
    if (focus === null) return { position: this.anchor.clone(), orientation, scale: size };
    const whole = place(this.bounds);
    const tile = place(focus);
    const edge = ({ min, max }: Bounds, axis: 0 | 1) => Math.max(max[axis] - min[axis], 1e-9);
    const fits = ([0, 1] as const).map((axis) => edge(this.bounds, axis) / edge(focus, axis));
    const scale = size * Math.min(...fits);
    const aside = new Vector3(...whole.center).sub(new Vector3(...tile.center));
    const away = aside.multiplyScalar(scale * whole.scale).applyQuaternion(orientation);
    const position = away.add(this.anchor);
    return { position, orientation, scale };
  }

  goHome(): void {
    this.hasJumped = true;
    this.settle(this.home);
  }

  /** Moves the specimen to another pose at once, as a jump. */
  jumpTo(pose: SpecimenPose, viewer: Vector3): void {
    this.hasJumped = true;
    this.moveTo(pose, viewer);
  }

  /** Returns whether the specimen has jumped since the last call of this method. */
  takeJump(): boolean {
    const { hasJumped } = this;
    this.hasJumped = false;
    return hasJumped;
  }

  /**
   * Moves the specimen as a hand demands.
   * @param viewer position of the eyes in the scene
   */
  moveTo(pose: SpecimenPose, viewer: Vector3): void {
    const farthest_m = FARTHEST_M + (LONGEST_EDGE_M * pose.scale) / 2;
    this.settle(limitPlacement(pose, viewer, farthest_m, this.home));
    this.isMoved = true;
  }

  /** Advances a gradual move of the specimen. Returns whether the move is still going on. */
  advance(dt_s: number): boolean {
    if (this.way === 1) return false;
    this.way = Math.min(1, this.way + dt_s / MOVE_S);
    const eased = this.way * this.way * (3 - 2 * this.way);
    const { start, goal } = this;
    this.pose = {
      position: start.position.clone().lerp(goal.position, eased),
      orientation: start.orientation.clone().slerp(goal.orientation, eased),
      scale: start.scale * (goal.scale / start.scale) ** eased,
    };
    this.apply();
    return this.way < 1;
  }

  private settle(pose: SpecimenPose): void {
    this.isMoved = false;
    this.pose = this.start = this.goal = pose;
    this.way = 1;
    this.apply();
  }

  private apply(): void {
    this.group.matrix.copy(poseMatrix(this.pose)).multiply(this.base);
    this.group.matrixWorldNeedsUpdate = true;
    this.group.updateMatrixWorld(true);
  }
}
