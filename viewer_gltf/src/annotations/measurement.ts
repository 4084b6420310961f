/** The measured points, the line between them, their distance, and the channels' values there. */
import { CylinderGeometry, Object3D, SphereGeometry, Vector3 } from "three";
import type { Vec3 } from "../math/vec3";
import { Label } from "./label";
import { distanceBetween, distanceText } from "./measure";
import {
  disposeMarks,
  LINE_RADIUS,
  lengthAt,
  MEASURE,
  markMesh,
  POINT_RADIUS,
  rimmed,
  type Sight,
} from "./style";

const UP = new Vector3(0, 1, 0);
/** Colour of points and labels, as hex. */
const COLOR = "#ffd24a";

export class MeasureMark {
  readonly group = new Object3D();
  readonly distance = new Label("above", COLOR);
  private readonly line = markMesh(new CylinderGeometry(0.5, 0.5, 1, 8, 1, true), MEASURE);
  private readonly ends = [new End(), new End()] as const;
  private readonly middle = new Vector3();
  /** From the first point to the second. */
  private readonly stretched = new Vector3();
  private count = 0;
  private key = "";

  /**
   * @param read what the channels are at a point, um, a line each
   * @param onChange called when values have come
   */
  constructor(
    private readonly read: (point: Vec3) => Promise<readonly string[]>,
    private readonly onChange: () => void,
  ) {
    this.group.add(this.line, this.distance.sprite);
    for (const { mesh, values } of this.ends) this.group.add(mesh, values.sprite);
    this.show([], "");
  }

  /** `key` names what else the values depend on: they are read anew when it differs. */
  show(points: readonly Vec3[], key: string): void {
    this.count = points.length;
    this.ends.forEach(({ mesh, values }, i) => {
      mesh.visible = i < points.length;
      if (mesh.visible) mesh.position.set(...points[i]);
      else values.write("");
    });
    const [a, b] = points;
    const isLine = a !== undefined && b !== undefined;
    this.line.visible = isLine;
    this.distance.write(isLine ? distanceText(distanceBetween(a, b)) : "");
    if (isLine) this.stretch();
    const next = `${points.join(" ")} ${key}`;
    if (next === this.key) return;
    this.key = next;
    points.forEach((point, i) => {
      void this.readAt(i, point, next);
    });
  }

  /** With the next `show`, whatever its key. */
  readAnew(): void {
    this.key = "";
  }

  update(sight: Sight): void {
    for (const { mesh, values } of this.ends) {
      if (!mesh.visible) continue;
      mesh.scale.setScalar(lengthAt(mesh.position, sight, 2 * POINT_RADIUS));
      values.place(mesh.position, sight);
    }
    const [a, b] = this.ends;
    // away from each other, so that none lies on the distance
    const isHigher = this.line.visible && this.stretched.dot(sight.up) < 0;
    a.values.turnTo(isHigher ? "above" : "below");
    b.values.turnTo(isHigher || !this.line.visible ? "below" : "above");
    if (!this.line.visible) return;
    const width = lengthAt(this.middle, sight, 2 * LINE_RADIUS);
    this.line.scale.setX(width).setZ(width);
    this.distance.place(this.middle, sight);
  }

  /** The text at a point. */
  valuesAt(index: 0 | 1): string {
    const { values } = this.ends[index];
    return values.sprite.visible ? values.text : "";
  }

  private stretch(): void {
    const [a, b] = this.ends.map(({ mesh }) => mesh.position);
    const along = this.stretched.subVectors(b, a);
    this.middle.copy(a).addScaledVector(along, 0.5);
    this.line.position.copy(this.middle);
    this.line.scale.setY(along.length());
    this.line.quaternion.setFromUnitVectors(UP, along.clone().normalize());
  }

  private async readAt(index: number, point: Vec3, key: string): Promise<void> {
    const lines = await this.read(point);
    if (key !== this.key || index >= this.count) return; // measured anew meanwhile
    this.ends[index].values.write(lines.join("\n"));
    this.onChange();
  }

  dispose(): void {
    this.key = "disposed";
    this.group.removeFromParent();
    this.distance.dispose();
    for (const { values } of this.ends) values.dispose();
    disposeMarks(this.group);
  }
}

class End {
  readonly mesh = rimmed(markMesh(new SphereGeometry(0.5, 16, 10), MEASURE));
  readonly values = new Label("below");
}
