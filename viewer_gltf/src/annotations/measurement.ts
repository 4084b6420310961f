/** Measurements in the scene: their points, the segments between them, the result, and the channels' values. */
import { CylinderGeometry, Object3D, SphereGeometry, Vector3 } from "three";
import { keepApart } from "../marks/keep_apart";
import { Label } from "../marks/label";
import {
  disposeMarks,
  type EyeView,
  LINE_RADIUS,
  lengthAt,
  type MarkMesh,
  MEASURE,
  markMesh,
  POINT_RADIUS,
  rimmed,
} from "../marks/style";
import type { Vec3 } from "../math/vec3";
import { measurementText } from "../probe/measure";
import { type Measurement, missing } from "../state/measurements";
import type { MeasureKind } from "../state/parameters/tools";

const UP = new Vector3(0, 1, 0);
/** Colour of points and labels, as #rrggbb. */
const COLOR = "#ffd24a";

/** The points, segments and label of one measurement. */
class MeasurementLine {
  readonly group = new Object3D();
  readonly label = new Label("above", COLOR);
  private readonly points: MarkMesh[] = [];
  private readonly segments: MarkMesh[] = [];
  private readonly middle = new Vector3();
  private count = 0;

  constructor() {
    this.group.add(this.label.sprite);
  }

  show(places: readonly Vec3[], text: string): void {
    this.count = places.length;
    while (this.points.length < places.length) {
      const point = rimmed(markMesh(new SphereGeometry(0.5, 16, 10), MEASURE));
      this.points.push(point);
      this.group.add(point);
    }
    while (this.segments.length < places.length - 1) {
      const line = markMesh(new CylinderGeometry(0.5, 0.5, 1, 8, 1, true), MEASURE);
      this.segments.push(line);
      this.group.add(line);
    }
    removeMarks(this.points.splice(places.length));
    removeMarks(this.segments.splice(Math.max(0, places.length - 1)));
    this.points.forEach((mesh, i) => {
      mesh.position.set(...places[i]);
    });
    this.segments.forEach((mesh, i) => {
      placeSegment(mesh, places[i], places[i + 1]);
    });
    this.label.write(places.length > 1 ? text : "");
    if (places.length < 2) return;
    // the label stands at the middle of the middle segment; with an odd number of points, near the middle point
    const half = (places.length - 1) / 2;
    const [a, b] = [places[Math.floor(half - 1e-9)], places[Math.floor(half - 1e-9) + 1]];
    this.middle.set(...a).lerp(new Vector3(...b), places.length % 2 === 0 ? 0.5 : 0.85);
  }

  get isLine(): boolean {
    return this.count > 1;
  }

  /** Sets `out` to the vector from a point to the next one, um, and returns it. */
  along(index: number, out: Vector3): Vector3 {
    return out.subVectors(this.points[index + 1].position, this.points[index].position);
  }

  placeOf(index: number): Vector3 {
    return this.points[index].position;
  }

  update(eyeView: EyeView): void {
    for (const mesh of this.points) {
      mesh.scale.setScalar(lengthAt(mesh.position, eyeView, 2 * POINT_RADIUS));
    }
    for (const mesh of this.segments) {
      const width = lengthAt(mesh.position, eyeView, 2 * LINE_RADIUS);
      mesh.scale.setX(width).setZ(width);
    }
    this.label.place(this.middle, eyeView);
  }

  dispose(): void {
    this.group.removeFromParent();
    this.label.dispose();
    disposeMarks(this.group);
  }
}

/** Removes marks from their group, and frees their GPU resources. */
function removeMarks(marks: readonly MarkMesh[]): void {
  for (const mark of marks) {
    mark.removeFromParent();
    disposeMarks(mark);
  }
}

function placeSegment(mesh: MarkMesh, from: Vec3, to: Vec3): void {
  const a = new Vector3(...from);
  const along = new Vector3(...to).sub(a);
  mesh.position.copy(a).addScaledVector(along, 0.5);
  mesh.scale.setY(along.length());
  mesh.quaternion.setFromUnitVectors(UP, along.normalize());
}

export class MeasureMark {
  readonly group = new Object3D();
  private readonly newest = new MeasurementLine();
  private readonly finished: MeasurementLine[] = [];
  /** Labels with the channels' values at the points of the newest measurement. */
  private readonly values: Label[] = [];
  private readonly segment = new Vector3();
  /** Direction from the eye to the labels; with `right` and `up`, the axes in which labels are kept apart. */
  private readonly ahead = new Vector3();
  private readonly right = new Vector3();
  private readonly up = new Vector3();
  private count = 0;
  private key = "";

  /**
   * @param read returns a line with the value of each channel at a point in um
   * @param onChange called when values have loaded
   */
  constructor(
    private readonly read: (point: Vec3) => Promise<readonly string[]>,
    private readonly onChange: () => void,
  ) {
    this.group.add(this.newest.group);
    this.show([], "distance", "");
  }

  /** The label with the result of the newest measurement. */
  get distance(): Label {
    return this.newest.label;
  }

  /** Shows the finished measurements with their names. */
  list(measurements: readonly Measurement[]): void {
    while (this.finished.length < measurements.length) {
      const line = new MeasurementLine();
      this.finished.push(line);
      this.group.add(line.group);
    }
    for (const line of this.finished.splice(measurements.length)) line.dispose();
    this.finished.forEach((line, i) => {
      const { name, kind, points } = measurements[i];
      line.show(points, `${name}\n${measurementText(kind, points)}`);
    });
  }

  /**
   * Shows the newest measurement. The values at its points are read again when a point or `key`
   * changes.
   *
   * @param key a text that names the volumes from which the values are read
   */
  show(points: readonly Vec3[], kind: MeasureKind, key: string): void {
    this.count = points.length;
    const isDone = missing(kind, points) === 0;
    this.newest.show(points, isDone ? measurementText(kind, points) : "");
    while (this.values.length < points.length) {
      const label = new Label("below");
      this.values.push(label);
      this.group.add(label.sprite);
    }
    for (const label of this.values.splice(points.length)) label.dispose();
    const next = `${points.join(" ")} ${key}`;
    if (next === this.key) return;
    this.key = next;
    points.forEach((point, i) => {
      void this.readAt(i, point, next);
    });
  }

  /** Makes the next `show` read the values again, even if its key has not changed. */
  rereadValues(): void {
    this.key = "";
  }

  update(eyeView: EyeView): void {
    for (const { label } of [this.newest, ...this.finished]) label.shift(0);
    this.newest.update(eyeView);
    for (const line of this.finished) line.update(eyeView);
    for (let i = 0; i < this.count; i++) {
      // the values stand on the side of the point that leads away from the line, so that they do not cover the result
      const before = i === 0 ? 0 : i - 1;
      const { isLine } = this.newest;
      const leadsDown = isLine && this.newest.along(before, this.segment).dot(eyeView.up) < 0;
      const isAbove = isLine && (i === 0) === leadsDown;
      this.values[i].turnTo(isAbove ? "above" : "below");
      this.values[i].place(this.newest.placeOf(i), eyeView);
    }
    this.keepLabelsApart(eyeView);
  }

  /** Shifts labels that would overlap. The newest measurement's labels stay, and the others make way. */
  private keepLabelsApart(eyeView: EyeView): void {
    const finished = this.finished.map(({ label }) => label);
    const labels = [this.newest.label, ...this.values, ...finished].filter(
      ({ sprite }) => sprite.visible,
    );
    if (labels.length < 2) return;
    const { ahead, right, up } = this;
    ahead.set(0, 0, 0);
    for (const { sprite } of labels) ahead.add(sprite.position);
    ahead.divideScalar(labels.length).sub(eyeView.eye_um).normalize();
    right.crossVectors(ahead, eyeView.up).normalize();
    up.crossVectors(right, ahead);
    const shifts = keepApart(labels.map((label) => label.boxFrom(eyeView, right, up)));
    labels.forEach((label, i) => {
      label.shift(shifts[i]);
    });
  }

  /** The channels' values at a point, one line each; "": not loaded yet. */
  valuesAt(index: number): string {
    const label = this.values[index];
    return label?.sprite.visible ? label.text : "";
  }

  private async readAt(index: number, point: Vec3, key: string): Promise<void> {
    const lines = await this.read(point);
    if (key !== this.key || index >= this.count) return; // the points have changed meanwhile
    this.values[index].write(lines.join("\n"));
    this.onChange();
  }

  dispose(): void {
    this.key = "disposed";
    this.group.removeFromParent();
    this.newest.dispose();
    for (const line of this.finished) line.dispose();
    for (const label of this.values) label.dispose();
  }
}
