/** Outlines of the clip box and the clip plane, with handles that drag them. Children of the specimen, in um. */
import {
  BoxGeometry,
  BufferAttribute,
  BufferGeometry,
  ConeGeometry,
  DoubleSide,
  EdgesGeometry,
  Object3D,
  OctahedronGeometry,
  SphereGeometry,
  Vector3,
} from "three";
import {
  BOX_HANDLES,
  boxWithin,
  type ClipHandleId,
  type HandleId,
  handlesOf,
  PLANE_HANDLES,
} from "../marks/clip_handles";
import {
  ACCENT,
  BRIGHT,
  DIM,
  disposeMarks,
  type EyeView,
  HANDLE_RADIUS,
  HIGHLIGHT_SCALE,
  lengthAt,
  MARKS_ORDER,
  type MarkMesh,
  markLine,
  markMesh,
  PLANE,
  rimmed,
} from "../marks/style";
import type { Box } from "../math/box";
import type { Clip, ClipPlane } from "../math/clip";
import { MAX_CORNERS, planeSection } from "../math/plane_box_section";
import type { Vec3 } from "../math/vec3";

const UP = new Vector3(0, 1, 0);

export class ClipMark {
  readonly group = new Object3D();
  private readonly handles = new Map<ClipHandleId, MarkMesh>();
  private readonly edges = markLine(new EdgesGeometry(new BoxGeometry()), DIM, { opacity: 0.8 });
  private readonly rim = markLine(points(MAX_CORNERS), PLANE, { isLoop: true, opacity: 0.9 });
  private readonly sheet = markMesh(fan(this.rim.geometry), PLANE, 0.08);
  private readonly arm = markLine(points(2), PLANE);
  private highlighted: HandleId | null = null;

  constructor() {
    const ball = new SphereGeometry(0.5, 20, 12);
    const shapes = {
      "plane-middle": new OctahedronGeometry(0.6),
      "plane-tip": new ConeGeometry(0.5, 1.2, 20),
    };
    for (const id of BOX_HANDLES) this.handles.set(id, rimmed(markMesh(ball, ACCENT)));
    for (const id of PLANE_HANDLES) {
      this.handles.set(id, rimmed(markMesh(shapes[id], PLANE)));
    }
    this.sheet.material.side = DoubleSide;
    this.sheet.renderOrder = MARKS_ORDER - 1; // drawn before the handles
    // removes the faint copy (ghost), which would show through the specimen and dull it
    this.sheet.clear();
    this.group.add(this.edges, this.rim, this.sheet, this.arm, ...this.handles.values());
    this.show({ box: null, plane: null }, { min: [0, 0, 0], max: [1, 1, 1] });
  }

  /** @param shown box of the shown specimen or the isolated tile, um */
  show(clip: Clip, shown: Box): void {
    const { box, plane } = clip;
    this.edges.visible = box !== null;
    if (box !== null) {
      const { min, max } = boxWithin(box, shown);
      const low = new Vector3(...min);
      this.edges.scale.set(...max).sub(low);
      this.edges.position.copy(low).addScaledVector(this.edges.scale, 0.5);
    }
    for (const mesh of this.handles.values()) mesh.visible = false;
    for (const { id, position } of handlesOf(clip, shown)) {
      const mesh = this.handles.get(id);
      mesh?.position.set(...position);
      if (mesh !== undefined) mesh.visible = true;
    }
    this.arm.visible = plane !== null;
    this.rim.visible = plane !== null;
    this.sheet.visible = this.isSheetShown;
    if (plane !== null) this.showPlane(plane, shown);
  }

  /** Whether the translucent sheet of the clip plane is drawn, which is only while its handle is used. */
  private get isSheetShown(): boolean {
    return this.rim.visible && this.highlighted?.startsWith("plane") === true;
  }

  /** Sets the handle that is pointed at or held. Returns whether it differs from before. */
  highlight(id: HandleId | null): boolean {
    if (id === this.highlighted) return false;
    this.highlighted = id;
    this.sheet.visible = this.isSheetShown;
    for (const [each, { material }] of this.handles) {
      material.color.setHex(each === id ? BRIGHT : each.startsWith("plane") ? PLANE : ACCENT);
    }
    return true;
  }

  update(eyeView: EyeView): void {
    for (const [id, mesh] of this.handles) {
      if (!mesh.visible) continue;
      const size = lengthAt(mesh.position, eyeView, 2 * HANDLE_RADIUS);
      mesh.scale.setScalar(id === this.highlighted ? HIGHLIGHT_SCALE * size : size);
    }
  }

  private showPlane(plane: ClipPlane, shown: Box): void {
    const corners = planeSection(plane, shown);
    write(this.rim.geometry, corners);
    this.sheet.geometry.setDrawRange(0, 3 * Math.max(0, corners.length - 2));
    this.rim.visible = corners.length > 0;
    this.sheet.visible = this.isSheetShown;
    const middle = this.handles.get("plane-middle");
    const tip = this.handles.get("plane-tip");
    if (middle === undefined || tip === undefined) return;
    tip.quaternion.setFromUnitVectors(UP, new Vector3(...plane.normal));
    write(this.arm.geometry, [middle.position.toArray(), tip.position.toArray()]);
  }

  dispose(): void {
    this.group.removeFromParent();
    disposeMarks(this.group);
  }
}

function points(count: number): BufferGeometry {
  const positions = new BufferAttribute(new Float32Array(3 * count), 3);
  return new BufferGeometry().setAttribute("position", positions);
}

/** Triangles that fill a convex rim; they share its points. */
function fan(rim: BufferGeometry): BufferGeometry {
  const corners = Array.from({ length: MAX_CORNERS - 2 }, (_, i) => [0, i + 1, i + 2]);
  return new BufferGeometry()
    .setAttribute("position", rim.attributes.position)
    .setIndex(corners.flat());
}

function write(geometry: BufferGeometry, places: readonly Vec3[]): void {
  const { position } = geometry.attributes;
  places.forEach((place, i) => {
    position.setXYZ(i, ...place);
  });
  position.needsUpdate = true;
  geometry.setDrawRange(0, places.length);
}
