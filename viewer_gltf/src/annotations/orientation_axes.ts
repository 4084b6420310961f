/**
 * Three labelled axes that show how the specimen is turned. At the start x leads to the right, y up and z to the user.
 * If the sides of a patient are known, the axes carry the letters of the sides at both ends: L R, S I, A P. On a flat
 * screen the axes are a small drawing in the lower right corner, in a headset an object beside the specimen.
 */
import { ConeGeometry, CylinderGeometry, type Matrix4, Object3D, Quaternion, Vector3 } from "three";
import type { Sides } from "../bundle/generated/bundle";
import { type Axis, axesOf, axesSeen } from "../marks/axes";
import { Label } from "../marks/label";
import {
  AXIS_COLORS,
  disposeMarks,
  type EyeView,
  lengthAt,
  type MarkMesh,
  markOf,
  type Piece,
} from "../marks/style";
import type { Box } from "../math/box";

const SVG = "http://www.w3.org/2000/svg";
/** Half the drawing's edge, in its own units; so are the length of an axis and the distance of its letter. */
const HALF = 40;
const LENGTH = 26;
const LETTER = 33;
/** Smallest component along the view, 0..1, at which an axis hides its far letter, which the near one would cover. */
const END_ON = 0.9;

/** One end of an axis: the line from the centre, and its letter. */
class End {
  readonly whole: SVGElement;
  private readonly line: SVGElement;
  private readonly letter: SVGElement;

  constructor(
    root: SVGElement,
    readonly axis: number,
    readonly sign: 1 | -1,
    text: string,
  ) {
    this.whole = append("g", root);
    this.whole.dataset.axis = text;
    this.line = append("line", this.whole);
    this.line.setAttribute("stroke", AXIS_COLORS[axis]);
    this.letter = append("text", this.whole);
    this.letter.setAttribute("fill", AXIS_COLORS[axis]);
    this.letter.textContent = text;
  }

  /** @param seen direction of the axis in the eye's space: x right, y up, z to the eye */
  place(seen: Vector3, hasOpposite: boolean): void {
    const [x, y, z] = seen.toArray().map((part) => this.sign * part);
    this.line.setAttribute("x2", (LENGTH * x).toFixed(2));
    this.line.setAttribute("y2", (-LENGTH * y).toFixed(2));
    this.letter.setAttribute("x", (LETTER * x).toFixed(2));
    this.letter.setAttribute("y", (-LETTER * y).toFixed(2));
    this.letter.setAttribute("visibility", hasOpposite && z < -END_ON ? "hidden" : "inherit");
    this.whole.setAttribute("opacity", z < -0.1 ? "0.55" : "1"); // an end that leads away is dim
  }
}

function append(tag: "g" | "line" | "text", parent: SVGElement): SVGElement {
  const made = document.createElementNS(SVG, tag);
  parent.append(made);
  return made;
}

export class OrientationMark {
  readonly root: SVGSVGElement;
  private readonly axes: readonly Axis[];
  private readonly ends: readonly End[];

  constructor(sides?: Sides) {
    this.root = document.createElementNS(SVG, "svg");
    this.root.setAttribute("class", "orientation-mark");
    this.root.setAttribute("viewBox", `${-HALF} ${-HALF} ${2 * HALF} ${2 * HALF}`);
    this.root.setAttribute("role", "img");
    this.axes = axesOf(sides);
    this.ends = this.axes.flatMap(({ ends: [forth, back] }, i) => [
      new End(this.root, i, 1, forth),
      ...(back === null ? [] : [new End(this.root, i, -1, back)]),
    ]);
  }

  update(head: Matrix4, specimen: Matrix4): void {
    const seen = axesSeen(head, specimen, this.axes);
    for (const end of this.ends) end.place(seen[end.axis], this.axes[end.axis].ends[1] !== null);
    const depth = (end: End) => end.sign * seen[end.axis].z;
    const order = [...this.ends].sort((a, b) => depth(a) - depth(b));
    const isDrawn = order.every(({ whole }, i) => this.root.children[i] === whole);
    if (!isDrawn) this.root.append(...order.map(({ whole }) => whole));
    const [first, ...others] = this.axes.map(({ word }, i) => [word, directionName(seen[i])]);
    const rest = others.map(([word, where]) => `${word} ${where}`).join(", ");
    this.root.setAttribute("aria-label", `${first[0]} leads ${first[1]}, ${rest}`);
  }

  dispose(): void {
    this.root.remove();
  }
}

/** Returns the name of the nearest of the six directions. */
function directionName(axis: Vector3): string {
  const parts = axis.toArray();
  const largest = parts.reduce((best, v, i) => (Math.abs(v) > Math.abs(parts[best]) ? i : best), 0);
  const [back, forth] = [
    ["left", "right"],
    ["down", "up"],
    ["away", "towards you"],
  ][largest];
  return parts[largest] > 0 ? forth : back;
}

/** The axes as an object in the scene, for a headset. It is a child of the specimen, in um. */
export class Axes {
  readonly group = new Object3D();
  private readonly arrows: MarkMesh;
  /** The direction of each arm, and its letter. */
  private readonly arms: readonly { direction: Vector3; label: Label }[];
  /** Whether arms lead both ways; the axes then stand farther from the specimen. */
  private readonly isCross: boolean;
  private readonly tip = new Vector3();

  constructor(sides?: Sides) {
    const axes = axesOf(sides);
    this.isCross = sides !== undefined;
    const arms = axes.flatMap(({ direction, ends: [forth, back] }, i) => [
      { direction: new Vector3(...direction), text: forth, axis: i, hasHead: true },
      ...(back === null
        ? []
        : [{ direction: new Vector3(...direction).negate(), text: back, axis: i, hasHead: false }]),
    ]);
    this.arrows = markOf(arms.flatMap(arrow));
    this.arms = arms.map(({ direction, text, axis }) => {
      const label = new Label("above", AXIS_COLORS[axis]);
      label.write(text);
      return { direction, label };
    });
    this.group.add(this.arrows, ...this.arms.map(({ label }) => label.sprite));
  }

  /** Places the axes to the left of the lower front corner of the shown box, in um. */
  update({ min, max }: Box, eyeView: EyeView): void {
    const aside = GAP * Math.max(max[0] - min[0], max[1] - min[1], max[2] - min[2]);
    this.arrows.position.set(min[0] - aside, min[1] - aside / 2, max[2]);
    const length = lengthAt(this.arrows.position, eyeView, ARROW_RAD);
    if (this.isCross) this.arrows.position.x -= length;
    this.arrows.scale.setScalar(length);
    for (const { direction, label } of this.arms) {
      this.tip
        .copy(direction)
        .multiplyScalar(1.1 * length)
        .add(this.arrows.position);
      label.place(this.tip, eyeView);
    }
  }

  dispose(): void {
    this.group.removeFromParent();
    for (const { label } of this.arms) label.dispose();
    disposeMarks(this.arrows);
  }
}

/** Returns the shapes of an arm of length 1 from the centre; only arms with `hasHead` end in a cone. */
function arrow({ direction, axis, hasHead }: Arm): readonly Piece[] {
  const color = AXIS_COLORS[axis];
  const turn = new Quaternion().setFromUnitVectors(UP, direction);
  const shaft = new CylinderGeometry(0.03, 0.03, 0.8, 8).translate(0, 0.4, 0);
  const head = new ConeGeometry(0.09, 0.22, 12).translate(0, 0.9, 0);
  const shapes = hasHead ? [shaft, head] : [shaft];
  return shapes.map((shape) => ({ geometry: shape.applyQuaternion(turn), color }));
}

type Arm = Readonly<{ direction: Vector3; axis: number; hasHead: boolean }>;

const UP = new Vector3(0, 1, 0);
/** Distance between specimen and axes, as a share of the specimen's longest edge. */
const GAP = 0.12;
/** Angle that an arm fills in the user's view, radians. */
const ARROW_RAD = (3 * Math.PI) / 180;
