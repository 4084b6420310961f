/** Text in the scene that faces the eye and keeps its angular size. It is drawn again only when the text changes. */
import {
  CanvasTexture,
  LinearFilter,
  Sprite,
  SpriteMaterial,
  SRGBColorSpace,
  type Vector3,
} from "three";
import type { LabelBox } from "./keep_apart";
import { type EyeView, LABEL_HEIGHT, lengthAt, MARKS_ORDER } from "./style";

/** Pixels of the canvas for each line; enough for a headset and for a phone's dense screen. */
const LINE_PX = 56;
const TEXT_PX = 40;
const PAD_PX = 14;

/** Position of a label relative to its point: `above`, `below`, or `aside` (to the right and above). */
export type Side = "above" | "below" | "aside";
/** Position of the point: share of the width from the left, and lines above the lower (0) or upper (1) edge. */
const POINTS = {
  above: { share: 0.5, edge: 0, lines: -0.45 },
  below: { share: 0.5, edge: 1, lines: 0.45 },
  aside: { share: -0.08, edge: 0, lines: -0.6 },
} as const;

export class Label {
  readonly sprite: Sprite;
  /** How often the text was drawn. */
  draws = 0;
  private readonly canvas = document.createElement("canvas");
  private readonly texture = new CanvasTexture(this.canvas);
  /** The text that was drawn last. */
  text = "";
  private lines = 0;

  constructor(
    private side: Side,
    private readonly color = "#e6e9f0",
    private readonly height_rad = LABEL_HEIGHT,
  ) {
    this.texture.colorSpace = SRGBColorSpace;
    this.texture.minFilter = LinearFilter;
    this.texture.generateMipmaps = false;
    const material = new SpriteMaterial({
      map: this.texture,
      transparent: true,
      depthTest: false,
      depthWrite: false,
      toneMapped: false,
      fog: false,
    });
    this.sprite = new Sprite(material);
    this.sprite.renderOrder = MARKS_ORDER + 1;
    this.sprite.visible = false;
  }

  /** Shows a text of one line, or of several with \n between them. An empty text hides the label. */
  write(text: string): void {
    this.sprite.visible = text !== "";
    if (text === this.text || text === "") return;
    this.text = text;
    this.draw(text.split("\n"));
  }

  /** Places the label at a point, um. */
  place(point: Vector3, { eye_um, textZoom }: EyeView): void {
    if (!this.sprite.visible) return;
    const line = lengthAt(point, { eye_um, zoom: textZoom }, this.height_rad);
    const height = line * this.lines;
    this.sprite.position.copy(point);
    this.sprite.scale.set((height * this.canvas.width) / this.canvas.height, height, 1);
  }

  turnTo(side: Side, up_lines = 0): void {
    this.side = side;
    const { share, edge, lines } = POINTS[side];
    this.sprite.center.set(share, edge + (lines - up_lines) / Math.max(1, this.lines));
  }

  /**
   * Returns the label's box as an eye with these axes (`right` and `up`) sees it, in heights of a
   * text line.
   */
  boxFrom({ eye_um }: Pick<EyeView, "eye_um">, right: Vector3, up: Vector3): LabelBox {
    const { position, scale, center } = this.sprite;
    const line = scale.y / Math.max(1, this.lines);
    const from = position.clone().sub(eye_um);
    const [width, height] = [scale.x / line, this.lines];
    const x = from.dot(right) / line - center.x * width;
    const y = from.dot(up) / line - center.y * height;
    return { x, y, width, height, isAbove: this.side !== "below" };
  }

  /** Moves the label up from its usual position, by a number of lines. */
  shift(up_lines: number): void {
    this.turnTo(this.side, up_lines);
  }

  private draw(lines: readonly string[]): void {
    const context = this.canvas.getContext("2d");
    if (context === null) throw new Error("no 2D canvas");
    const font = `600 ${TEXT_PX}px system-ui, "Noto Sans", sans-serif`;
    context.font = font;
    const widest = Math.max(...lines.map((line) => context.measureText(line).width));
    this.canvas.width = Math.ceil(widest + 2 * PAD_PX);
    this.canvas.height = LINE_PX * lines.length;
    context.font = font; // changing the canvas's size resets its font
    context.fillStyle = "rgb(11 13 18 / 0.78)";
    context.beginPath();
    context.roundRect(0, 0, this.canvas.width, this.canvas.height, PAD_PX);
    context.fill();
    context.fillStyle = this.color;
    context.textBaseline = "middle";
    lines.forEach((line, i) => {
      context.fillText(line, PAD_PX, (i + 0.54) * LINE_PX);
    });
    this.texture.dispose(); // a texture on the GPU can't change its size
    this.texture.needsUpdate = true;
    this.lines = lines.length;
    this.draws++;
    this.turnTo(this.side);
  }

  dispose(): void {
    this.sprite.removeFromParent();
    this.sprite.material.dispose();
    this.texture.dispose();
  }
}
