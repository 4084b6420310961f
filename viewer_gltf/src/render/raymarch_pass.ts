/**
 * The volumes' picture: marched into textures of its own, at as many pixels as the frame's budget
 * allows, and laid over the scene: what lies behind translucent surfaces before these are drawn,
 * the rest last of all.
 */
import type { Mesh, Scene, Texture, WebGLRenderer, WebGLRenderTarget } from "three";
import { type Disc, FIRST, LAST, type MarchedUniforms, Overlay } from "../gpu/composite_pass";
import type { Eyes } from "../gpu/eyes";
import { linearTarget } from "../gpu/linear_target";
import { drawEyes } from "../gpu/offscreen_target";
import { aimLens, FilledPeriphery } from "../gpu/periphery";
import { RunningMean } from "../gpu/running_mean";
import type { MarchFrame } from "../voxels/march_frame";

export class MarchPass {
  readonly target: WebGLRenderTarget;
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
    this.target = linearTarget(renderer, { count: 2 });
    this.mean = new RunningMean(renderer);
    this.filled = new FilledPeriphery(renderer, frame.uLens);
    const [front, behind] = this.target.textures;
    this.front = new Overlay(front, frame.uSceneDepth, { order: LAST, disc });
    this.behind = new Overlay(behind, frame.uSceneDepth, { order: FIRST, disc });
  }

  /** They lay the marched pictures over what was drawn before. */
  get overlays(): readonly Mesh[] {
    return [this.front.mesh, this.behind.mesh];
  }

  /** The last picture that was marched, and its pixels to one of the frame buffer. */
  get marched(): Readonly<{ picture: Texture; scale: number }> {
    return { picture: this.front.uniforms.uMarched.value, scale: this.scale };
  }

  get isShown(): boolean {
    return this.front.mesh.visible;
  }

  /** For surfaces, which the picture takes the place of. */
  get picture(): MarchedUniforms {
    return this.front.uniforms;
  }

  /** Pictures of a view at rest that have been gathered; 0: the last one stands alone. */
  get gathered(): number {
    return this.mean.count;
  }

  /**
   * March what is in `scene`, at `scale` pixels to one of the picture, 0..1.
   *
   * @param gathers whether the picture is of the same view as the last one, and is averaged with it
   */
  render(scene: Scene, eyes: Eyes, scale: number, gathers = false): void {
    const isWorn = eyes.all.length > 1;
    drawEyes(this.renderer, scene, eyes, this.target, scale, (eye, part) => {
      this.frame.uEye.value.copy(eye.viewport);
      this.frame.uPart.value.copy(part);
      aimLens(eye, isWorn, this.frame.uLens.value);
    });
    if (isWorn) this.filled.render(this.target, eyes, scale);
    if (gathers) this.mean.add(this.target);
    else this.mean.count = 0;
    const shown = isWorn ? this.filled : gathers ? this.mean : this;
    const [front, behind] = shown.target.textures;
    this.front.uniforms.uMarched.value = front;
    this.behind.uniforms.uMarched.value = behind;
    this.scale = scale;
    this.front.show(eyes, scale);
    if (this.frame.uHasPane.value) this.behind.show(eyes, scale);
  }

  /** Nothing is marched. */
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
