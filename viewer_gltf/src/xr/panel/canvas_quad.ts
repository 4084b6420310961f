/**
 * A flat opaque rectangle in the scene with a canvas on it, which is painted again only when it
 * changes.
 */
import {
  CanvasTexture,
  LinearFilter,
  LinearMipmapLinearFilter,
  Matrix4,
  Mesh,
  MeshBasicMaterial,
  PlaneGeometry,
  SRGBColorSpace,
  Vector3,
} from "three";
import { keepUnclipped } from "../../gpu/unclipped_material";
import type { SceneRay } from "../../interaction/ray_pointer";
import { holds, type Mark, type Rect } from "../../panel/canvas/draw_list";
import { PX_PER_M } from "../../panel/canvas/page";
import { paint } from "../../panel/canvas/paint";

const LIT = 0xffffff;
/**
 * Opacity of the light on the control that is pointed at. Light is blended linearly, so 0.04 looks
 * like a fifth of white.
 */
const LIT_OPACITY = 0.04;
/** Metres between the quad and the light in front of it. */
const LIT_M = 0.001;
/** Anisotropy of the texture, samples, for text that is seen at an angle. */
const ANISOTROPY = 4;

/** A point on the quad in px, and its distance from the ray's origin. */
export type Spot = Readonly<{ x: number; y: number; distance_m: number }>;

export class CanvasQuad {
  readonly mesh: Mesh<PlaneGeometry, MeshBasicMaterial>;
  /** How often the canvas was painted; for tests. */
  paints = 0;
  private readonly lit: Mesh<PlaneGeometry, MeshBasicMaterial>;
  private readonly texture: CanvasTexture | null;
  private painted = "";
  private readonly toQuad = new Matrix4();

  /**
   * @param context of the canvas that is painted; undefined: a new canvas; null: none, as in tests
   */
  constructor(
    readonly width: number,
    readonly height: number,
    private readonly context: CanvasRenderingContext2D | null = newContext(width, height),
    private readonly pxPerM = PX_PER_M,
  ) {
    this.texture = context === null ? null : textureOf(context.canvas);
    this.mesh = new Mesh(
      new PlaneGeometry(width / pxPerM, height / pxPerM),
      new MeshBasicMaterial({ map: this.texture, toneMapped: false }),
    );
    this.mesh.visible = false;
    keepUnclipped(this.mesh);
    this.lit = new Mesh(
      new PlaneGeometry(1, 1),
      new MeshBasicMaterial({
        color: LIT,
        opacity: LIT_OPACITY,
        transparent: true,
        depthWrite: false,
        toneMapped: false,
      }),
    );
    this.lit.visible = false;
    this.mesh.add(this.lit);
  }

  /** Draws the quad over everything with a lower render order, even if that is nearer. */
  drawOver(renderOrder: number): void {
    for (const [i, mesh] of [this.mesh, this.lit].entries()) {
      mesh.material.transparent = true;
      mesh.material.depthTest = mesh.material.depthWrite = false;
      mesh.renderOrder = renderOrder + i;
    }
  }

  /**
   * Returns a point of a rect on the quad in the scene.
   * @param across, down shares of the rect, from its upper left corner
   */
  pointOf({ x, y, width, height }: Rect, across = 0.5, down = 0.5): Vector3 {
    return this.mesh.localToWorld(
      new Vector3(
        (x + across * width - this.width / 2) / this.pxPerM,
        (this.height / 2 - y - down * height) / this.pxPerM,
        0,
      ),
    );
  }

  /** Paints the marks. Returns false if they were painted already. */
  show(marks: readonly Mark[]): boolean {
    const text = JSON.stringify(marks);
    if (text === this.painted) return false;
    this.painted = text;
    this.paints++;
    if (this.context === null || this.texture === null) return true;
    this.context.clearRect(0, 0, this.width, this.height);
    paint(this.context, marks);
    this.texture.needsUpdate = true;
    return true;
  }

  /** Moves the quad's middle to a point, facing `eye`. */
  place(at: Vector3, eye: Vector3): void {
    this.mesh.position.copy(at);
    this.mesh.lookAt(eye);
    this.mesh.updateMatrixWorld();
  }

  /** Returns where a ray hits the front of the quad; null if it misses or the quad is hidden. */
  intersect({ origin, direction }: SceneRay): Spot | null {
    if (!this.mesh.visible) return null;
    this.toQuad.copy(this.mesh.matrixWorld).invert();
    const from = origin.clone().applyMatrix4(this.toQuad);
    const to = direction.clone().transformDirection(this.toQuad);
    if (from.z <= 0 || to.z >= 0) return null;
    const distance_m = -from.z / to.z; // in metres, because the quad is not scaled
    const x = (from.x + distance_m * to.x) * this.pxPerM + this.width / 2;
    const y = this.height / 2 - (from.y + distance_m * to.y) * this.pxPerM;
    const whole: Rect = { x: 0, y: 0, width: this.width, height: this.height };
    return holds(whole, { x, y }) ? { x, y, distance_m } : null;
  }

  /** Lights up a rect of the quad, without painting; null: no light. */
  light(rect: Rect | null): void {
    this.lit.visible = rect !== null;
    if (rect === null) return;
    const { x, y, width, height } = rect;
    this.lit.position.set(
      (x + width / 2 - this.width / 2) / this.pxPerM,
      (this.height / 2 - y - height / 2) / this.pxPerM,
      LIT_M,
    );
    this.lit.scale.set(width / this.pxPerM, height / this.pxPerM, 1);
  }

  dispose(): void {
    this.texture?.dispose();
    for (const { geometry, material } of [this.mesh, this.lit]) {
      geometry.dispose();
      material.dispose();
    }
  }
}

function newContext(width: number, height: number): CanvasRenderingContext2D {
  const canvas = document.createElement("canvas");
  canvas.width = width;
  canvas.height = height;
  const context = canvas.getContext("2d");
  if (context === null) throw new Error("the browser has no 2D canvas");
  return context;
}

function textureOf(canvas: HTMLCanvasElement): CanvasTexture {
  const texture = new CanvasTexture(canvas);
  texture.colorSpace = SRGBColorSpace;
  texture.minFilter = LinearMipmapLinearFilter;
  texture.magFilter = LinearFilter;
  texture.anisotropy = ANISOTROPY;
  return texture;
}
