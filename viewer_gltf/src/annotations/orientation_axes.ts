/**
 * How the specimen is turned, as three labelled axes: x to the right, y up, z to the viewer at the
 * start. A small drawing over a flat picture's lower right corner; in a headset an object beside the
 * specimen.
 */
import { ConeGeometry, CylinderGeometry, type Matrix4, Object3D, Quaternion, Vector3 } from "three";
import type { Box } from "../math/box";
import { Label } from "./label";
import { AXIS_COLORS, disposeMarks, lengthAt, markMesh, type Sight } from "./style";

export const AXIS_NAMES = ["x", "y", "z"] as const;
const SVG = "http://www.w3.org/2000/svg";
/** Of the drawing, in its own units. */
const HALF = 40;
const LENGTH = 26;
const LETTER = 33;

/**
 * The specimen's axes as the eye sees them: unit vectors, x to the right, y up, z to the eye. Pure.
 *
 * @param head from the eye to the room
 * @param specimen from um to the room
 */
export function axesSeen(head: Matrix4, specimen: Matrix4): readonly Vector3[] {
  const toEye = head.clone().invert();
  return AXIS_NAMES.map((_, i) =>
    new Vector3(...unit(i)).transformDirection(specimen).transformDirection(toEye),
  );
}

function unit(axis: number): [number, number, number] {
  return [axis === 0 ? 1 : 0, axis === 1 ? 1 : 0, axis === 2 ? 1 : 0];
}

export class OrientationMark {
  readonly root: SVGSVGElement;
  private readonly axes: readonly { whole: SVGElement; line: SVGElement; letter: SVGElement }[];

  constructor() {
    this.root = document.createElementNS(SVG, "svg");
    this.root.setAttribute("class", "orientation-mark");
    this.root.setAttribute("viewBox", `${-HALF} ${-HALF} ${2 * HALF} ${2 * HALF}`);
    this.root.setAttribute("role", "img");
    this.axes = AXIS_NAMES.map((name, i) => {
      const whole = this.add("g", this.root);
      whole.dataset.axis = name;
      const line = this.add("line", whole);
      line.setAttribute("stroke", AXIS_COLORS[i]);
      const letter = this.add("text", whole);
      letter.setAttribute("fill", AXIS_COLORS[i]);
      letter.textContent = name;
      return { whole, line, letter };
    });
  }

  private add(tag: "g" | "line" | "text", parent: SVGElement): SVGElement {
    const made = document.createElementNS(SVG, tag);
    parent.append(made);
    return made;
  }

  update(head: Matrix4, specimen: Matrix4): void {
    const seen = axesSeen(head, specimen);
    seen.forEach(({ x, y, z }, i) => {
      const { whole, line, letter } = this.axes[i];
      line.setAttribute("x2", (LENGTH * x).toFixed(2));
      line.setAttribute("y2", (-LENGTH * y).toFixed(2));
      letter.setAttribute("x", (LETTER * x).toFixed(2));
      letter.setAttribute("y", (-LETTER * y).toFixed(2));
      whole.setAttribute("opacity", z < -0.1 ? "0.55" : "1"); // leads away
    });
    const order = this.axes.map((_, i) => i).sort((a, b) => seen[a].z - seen[b].z);
    const isDrawn = order.every((axis, i) => this.root.children[i] === this.axes[axis].whole);
    if (!isDrawn) this.root.append(...order.map((i) => this.axes[i].whole));
    const [x, y, z] = seen.map((axis) => whither(axis));
    this.root.setAttribute("aria-label", `x leads ${x}, y ${y}, z ${z}`);
  }

  dispose(): void {
    this.root.remove();
  }
}

/** The nearest of the six directions, in words. */
function whither(axis: Vector3): string {
  const parts = axis.toArray();
  const largest = parts.reduce((best, v, i) => (Math.abs(v) > Math.abs(parts[best]) ? i : best), 0);
  const [back, forth] = [
    ["left", "right"],
    ["down", "up"],
    ["away", "towards you"],
  ][largest];
  return parts[largest] > 0 ? forth : back;
}

/** The same as an object in the room. um, world. */
export class Axes {
  readonly group = new Object3D();
  private readonly arrows = new Object3D();
  private readonly labels = AXIS_COLORS.map((color) => new Label("above", color));
  private readonly tip = new Vector3();

  constructor() {
    this.group.add(this.arrows, ...this.labels.map(({ sprite }) => sprite));
    AXIS_NAMES.forEach((name, i) => {
      const arrow = new Object3D();
      const shaft = markMesh(SHAFT, AXIS_COLORS[i]);
      const head = markMesh(HEAD, AXIS_COLORS[i]);
      shaft.position.y = 0.4;
      head.position.y = 0.9;
      arrow.add(shaft, head);
      arrow.quaternion.copy(new Quaternion().setFromUnitVectors(UP, new Vector3(...unit(i))));
      this.arrows.add(arrow);
      this.labels[i].write(name);
    });
  }

  /** Left of the front lower corner of what is shown. */
  update({ min, max }: Box, sight: Sight): void {
    const aside = GAP * Math.max(max[0] - min[0], max[1] - min[1], max[2] - min[2]);
    this.arrows.position.set(min[0] - aside, min[1] - aside / 2, max[2]);
    const length = lengthAt(this.arrows.position, sight, ARROW_RAD);
    this.arrows.scale.setScalar(length);
    this.labels.forEach((label, i) => {
      this.tip
        .set(...unit(i))
        .multiplyScalar(1.1 * length)
        .add(this.arrows.position);
      label.place(this.tip, sight);
    });
  }

  dispose(): void {
    this.group.removeFromParent();
    for (const label of this.labels) label.dispose();
    disposeMarks(this.arrows);
  }
}

const UP = new Vector3(0, 1, 0);
const GAP = 0.12;
const ARROW_RAD = (3 * Math.PI) / 180;
const SHAFT = new CylinderGeometry(0.03, 0.03, 0.8, 8);
const HEAD = new ConeGeometry(0.09, 0.22, 12);
