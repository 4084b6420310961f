/**
 * The ring at the end of a ray, which fills clockwise from the top during a dwell. It has a
 * constant size to the eye and is drawn over everything. It is as far away as the target, so that
 * both eyes see it there and not double.
 */
import {
  type BufferGeometry,
  CircleGeometry,
  DoubleSide,
  Group,
  Mesh,
  MeshBasicMaterial,
  RingGeometry,
  type Vector3,
} from "three";
import { mergeGeometries } from "three/examples/jsm/utils/BufferGeometryUtils.js";

const DIAMETER_DEG = 1.5;
/** Degrees. Diameter of the dot in its middle. */
const DOT_DEG = 0.3;
/** Inner radius as a share of the outer radius. */
const INNER_RADIUS = 0.72;
/**
 * Width of the dark rim, as a share of the radius; the rim makes white visible on any background.
 */
const RIM = 0.1;
const WHITE = 0xffffff;
const DARK = 0x0b0d12;
const PARTS = 72;
const INDICES_PER_PART = 6;
const DOT_PARTS = 24;
const DOT_INDICES = 3 * DOT_PARTS;
/** Draw order: after the volumes' image, which covers everything drawn before it. */
const OVER_ALL = 2000;
const RADIANS = Math.PI / 180;

export class Ring {
  readonly group = new Group();
  /**
   * Dot and ring of one colour are one mesh: the dot's triangles come first, then the filled part
   * of the ring.
   */
  private readonly dark = flat(
    new CircleGeometry(DOT_DEG / DIAMETER_DEG + RIM, DOT_PARTS),
    new RingGeometry(INNER_RADIUS - RIM, 1 + RIM, PARTS),
    DARK,
    0.6,
  );
  /**
   * The light dot and ring. The ring's triangles are in order clockwise from the top, so that a
   * part of them shows the progress.
   */
  private readonly light = flat(
    new CircleGeometry(DOT_DEG / DIAMETER_DEG, DOT_PARTS),
    new RingGeometry(INNER_RADIUS, 1, PARTS, 1, Math.PI / 2, -2 * Math.PI),
    WHITE,
    1,
  );

  constructor() {
    this.group.name = "ring";
    this.group.add(...this.parts);
    // the dark part first: both lie in one plane, so only the render order separates them
    this.parts.forEach((part, i) => {
      part.renderOrder = OVER_ALL + i;
    });
    this.hide();
  }

  private get parts() {
    return [this.dark, this.light];
  }

  get isShown(): boolean {
    return this.group.visible;
  }

  /** @param progress 0 to 1; at 0 only the dot is shown */
  show(at: Vector3, eye: Vector3, progress: number): void {
    const radius_m = at.distanceTo(eye) * Math.tan((DIAMETER_DEG / 2) * RADIANS);
    this.group.position.copy(at);
    this.group.scale.setScalar(radius_m);
    this.group.lookAt(eye);
    this.group.visible = true;
    const full = progress > 0 ? PARTS : 0;
    this.dark.geometry.setDrawRange(0, DOT_INDICES + INDICES_PER_PART * full);
    const filled = Math.round(progress * PARTS);
    this.light.geometry.setDrawRange(0, DOT_INDICES + INDICES_PER_PART * filled);
  }

  hide(): void {
    this.group.visible = false;
  }

  dispose(): void {
    for (const { geometry, material } of this.parts) {
      geometry.dispose();
      material.dispose();
    }
  }
}

function flat(
  dot: BufferGeometry,
  ring: BufferGeometry,
  color: number,
  opacity: number,
): Mesh<BufferGeometry, MeshBasicMaterial> {
  const material = new MeshBasicMaterial({
    color,
    opacity,
    transparent: true,
    depthTest: false,
    depthWrite: false,
    side: DoubleSide,
    toneMapped: false,
  });
  return new Mesh(mergeGeometries([dot, ring]), material);
}
