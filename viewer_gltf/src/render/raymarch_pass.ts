/**
 * The ray-marched image of the volumes. It is drawn into textures of its own, with as many pixels
 * as the frame's budget allows. The part behind translucent surfaces is composited before these are
 * drawn, the rest at the end.
 */
import type { Mesh, Scene, Texture, WebGLRenderer, WebGLRenderTarget } from "three";
import { type Disc, FIRST, LAST, type MarchedUniforms, Overlay } from "../gpu/composite_pass";
import type { Eyes } from "../gpu/eyes";
import { linearTarget, withTextures } from "../gpu/linear_target";
import { drawEyes } from "../gpu/offscreen_target";
import { aimLens, FilledPeriphery } from "../gpu/periphery";
import { RunningMean } from "../gpu/running_mean";
import type { MarchFrame } from "../voxels/march_frame";

export class MarchPass {
  /** The marched image, and the part behind translucent surfaces if there are any. */
  target: WebGLRenderTarget;
  private readonly mean: RunningMean;
  readonly filled: FilledPeriphery;
  private readonly front: Overlay;
  private readonly behind: Overlay;
  private scale = 1;

  constructor(
    private readonly renderer: WebGLRenderer,
    private readonly frame: MarchFrame,
    disc?: Disc,
  ) {
    this.target = linearTarget(renderer);
    this.mean = new RunningMean(renderer);
    this.filled = new FilledPeriphery(renderer, frame.uLens);
    const { texture } = this.target;
    this.front = new Overlay(texture, frame.uSceneDepth, { order: LAST, disc });
    this.behind = new Overlay(texture, frame.uSceneDepth, { order: FIRST, disc });
  }

  /** Meshes that composite the marched images over the frame. */
  get overlays(): readonly Mesh[] {
    return [this.front.mesh, this.behind.mesh];
  }

  /** The last marched image, and its pixels per pixel of the frame buffer. */
  get marched(): Readonly<{ image: Texture; scale: number }> {
    return { image: this.front.uniforms.uMarched.value, scale: this.scale };
  }

  get isShown(): boolean {
    return this.front.mesh.visible;
  }

  /** Uniforms with the marched image, for surfaces that it replaces. */
  get uniforms(): MarchedUniforms {
    return this.front.uniforms;
  }

  /** Number of images of a view at rest that are averaged; 0: the last image is shown alone. */
  get gathered(): number {
    return this.mean.count;
  }

  /**
   * Marches the volumes in `scene`, with `scale` pixels for each pixel of the frame along an edge,
   * 0 to 1.
   *
   * @param gathers whether the view is the same as in the last image, so that both are averaged
   */
  render(scene: Scene, eyes: Eyes, scale: number, gathers = false): void {
    const isWorn = eyes.all.length > 1;
    const hasPane = this.frame.uHasPane.value;
    this.target = withTextures(this.renderer, this.target, hasPane ? 2 : 1);
    drawEyes(this.renderer, scene, eyes, this.target, scale, (eye, part) => {
      this.frame.uEye.value.copy(eye.viewport);
      this.frame.uPart.value.copy(part);
      aimLens(eye, isWorn, this.frame.uLens.value);
    });
    if (isWorn) this.filled.render(this.target, eyes, scale);
    if (gathers) this.mean.add(this.target);
    else this.mean.count = 0;
    const shown = isWorn ? this.filled : gathers ? this.mean : this;
    const [front, behind = front] = shown.target.textures;
    this.front.uniforms.uMarched.value = front;
    this.behind.uniforms.uMarched.value = behind;
    this.scale = scale;
    this.front.show(eyes, scale);
    if (hasPane) this.behind.show(eyes, scale);
  }

  hide(): void {
    this.front.hide();
    this.behind.hide();
  }

  dispose(): void {
    this.target.dispose();
    this.mean.dispose();
    this.filled.dispose();
    this.front.dispose();
    this.behind.dispose();
  }
}
