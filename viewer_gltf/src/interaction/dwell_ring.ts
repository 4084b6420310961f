/**
 * The ring where a ray ends: it fills clockwise from the top while a dwell goes on. Of constant
 * size to the eye, over everything, and as far away as what is pointed at, so that both eyes see it
 * there and not twice.
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
const DOT_DEG = 0.3;
/** Inner radius as a share of the outer. */
const HOLE = 0.72;
/** Width of the dark rim, as a share of the radius: it makes white visible on anything. */
const RIM = 0.1;
const WHITE = 0xffffff;
const DARK = 0x0b0d12;
const PARTS = 72;
const INDICES_PER_PART = 6;
const DOT_PARTS = 24;
const DOT_INDICES = 3 * DOT_PARTS;
/** Render order: after the volumes' picture, which covers all that is drawn before it. */
const OVER_ALL = 2000;
const RADIANS = Math.PI / 180;

export class Ring {
  readonly group = new Group();
  /** Dot and ring of each colour are one thing to draw: the dot first, of the ring as much as shows. */
  private readonly dark = flat(
    new CircleGeometry(DOT_DEG / DIAMETER_DEG + RIM, DOT_PARTS),
    new RingGeometry(HOLE - RIM, 1 + RIM, PARTS),
    DARK,
    0.6,
  );
  /** Clockwise from the top, as a clock fills. */
  private readonly light = flat(
    new CircleGeometry(DOT_DEG / DIAMETER_DEG, DOT_PARTS),
    new RingGeometry(HOLE, 1, PARTS, 1, Math.PI / 2, -2 * Math.PI),
    WHITE,
    1,
  );

  constructor() {
    this.group.name = "ring";
    this.group.add(...this.parts);
    // the dark one first: they lie in one plane, so that nothing else gives their order
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

  /** @param progress 0..1; at 0 there is the dot alone */
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
