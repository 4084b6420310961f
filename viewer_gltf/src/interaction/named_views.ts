/** The named views of a specimen on a flat screen. Lengths are metres of the scene. */
import { Vector3 } from "three";
import { around, cornersOf } from "../math/box";
import type { Vec3 } from "../math/vec3";
import { framePoints, openingView, towardsEye } from "../render/opening_view";
import { framingDistance, type Placement } from "../render/placement";

export const FIELD_OF_VIEW_DEG = 40;
export const FARTHEST_M = 8;
/** Radians of the slow turn at the opening to either side, and seconds of one full swing. */
const SWAY_RAD = Math.PI / 10;
const SWAY_S = 30;
/**
 * Moments of the opening's swing, as shares of its period, at which the eye may be farthest from
 * the specimen.
 */
const TURNED = [-0.25, -0.125, 0, 0.125, 0.25];

/** The named views. A named view follows the window's shape until the user moves. */
export const NAMED_VIEWS = ["opening", "front", "side", "top"] as const;
export type NamedView = (typeof NAMED_VIEWS)[number];

/** Position of the camera and of the point that it looks at, metres of the scene. */
export type CameraPose = Readonly<{
  position: readonly [number, number, number];
  target: readonly [number, number, number];
}>;

/** Shares of the image's height, at its top and bottom, that are covered by other elements. */
export type Covered = Readonly<{ top: number; bottom: number }>;

/**
 * Largest share of the image's height, 0..1, that is counted as covered by buttons and texts when
 * the opening view is framed.
 */
const MOST_COVERED = 0.6;

export class NamedViews {
  /** Half of the specimen's edges, metres. */
  readonly reach: Vector3;
  /** Outermost points of the occupied part of the specimen, on which the opening is framed. */
  private occupied: readonly Vec3[];
  /** The opening is framed in the uncovered part of the image. */
  private covered: Covered = { top: 0, bottom: 0 };
  private aspect = 1;

  constructor(private readonly placement: Placement) {
    this.reach = new Vector3(...placement.size).multiplyScalar(0.5);
    const { x, y, z } = this.reach;
    this.occupied = cornersOf({ min: [-x, -y, -z], max: [x, y, z] });
  }

  /** Sets the shape of the image, and the parts of it that are covered. */
  fit(aspect: number, covered: Covered): void {
    // buttons and texts may be higher than a very low image
    const share = Math.min(1, MOST_COVERED / (covered.top + covered.bottom || 1));
    this.covered = { top: share * covered.top, bottom: share * covered.bottom };
    this.aspect = aspect;
  }

  /** Sets the outermost points of the occupied part of the specimen, um. */
  setOccupied(points: readonly Vec3[]): void {
    this.occupied = this.toScene(points);
  }

  /** Converts points of the specimen, um, to the scene, metres, as a flat screen shows it. */
  toScene(points: readonly Vec3[]): readonly Vec3[] {
    const { center, scale } = this.placement;
    const [cx, cy, cz] = center;
    return points.map(([x, y, z]) => [(x - cx) * scale, (y - cy) * scale, (z - cz) * scale]);
  }

  /** The camera of a named view of the whole specimen: x to the right and y up from the front. */
  lookAt(view: NamedView, swayed_s: number): CameraPose {
    const target = [0, 0, 0] as const;
    if (view === "opening") return this.lookAround(swayed_s);
    if (view === "front") return { position: [0, 0, this.framing(2)], target };
    if (view === "side") return { position: [this.framing(0), 0, 0], target };
    return { position: [0, this.framing(1), 1e-4], target };
  }

  /** The camera of the opening after `swayed_s` seconds of its slow turn. */
  private lookAround(swayed_s: number): CameraPose {
    const { top, bottom } = this.covered;
    const free = 1 - top - bottom;
    const half = Math.tan((FIELD_OF_VIEW_DEG * Math.PI) / 360); // half the image's height, at 1 m
    const lens = { fov_rad: 2 * Math.atan(free * half), aspect: this.aspect / free };
    const still = openingView(around(this.occupied), lens);
    const sway_rad = SWAY_RAD * Math.sin((2 * Math.PI * swayed_s) / SWAY_S);
    const direction = { ...still, aside_rad: still.aside_rad + sway_rad };
    const framed = framePoints(this.occupied, direction, lens, (bottom - top) * half);
    const target = new Vector3(...framed.target).clamp(this.reach.clone().negate(), this.reach);
    const away_m = Math.min(FARTHEST_M, framed.distance);
    const eye = target.clone().addScaledVector(new Vector3(...towardsEye(direction)), away_m);
    return { position: eye.toArray(), target: target.toArray() };
  }

  /** Largest distance of the eye from the middle during the opening's slow turn. */
  get openingDistance_m(): number {
    const looks = TURNED.map((part) => this.lookAround(part * SWAY_S));
    return Math.max(
      ...looks.map(({ position, target }) => Math.hypot(...position.map((v, i) => v - target[i]))),
    );
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
    return framingDistance(seen, (FIELD_OF_VIEW_DEG * Math.PI) / 180, this.aspect);
  }
}
