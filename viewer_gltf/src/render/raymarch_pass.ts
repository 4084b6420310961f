/**
 * The volumes' picture: marched into textures of its own, at as many pixels as the frame's budget
 * allows, and laid over the scene: what lies behind translucent surfaces before these are drawn,
 * the rest last of all.
 */
import type { Mesh, Scene, WebGLRenderer, WebGLRenderTarget } from "three";
import { type Disc, FIRST, LAST, type MarchedUniforms, Overlay } from "../gpu/composite_pass";
import type { Eyes } from "../gpu/eyes";
import { linearTarget } from "../gpu/linear_target";
import { drawEyes } from "../gpu/offscreen_target";
import type { MarchFrame } from "../volumes/tile_raymarch";

export class MarchPass {
  private readonly target: WebGLRenderTarget;
  private readonly front: Overlay;
  private readonly behind: Overlay;

  constructor(
    private readonly renderer: WebGLRenderer,
    private readonly frame: MarchFrame,
    disc?: Disc,
  ) {
    this.target = linearTarget(renderer, { count: 2 });
    const [front, behind] = this.target.textures;
    this.front = new Overlay(front, frame.uSceneDepth, { order: LAST, disc });
    this.behind = new Overlay(behind, frame.uSceneDepth, { order: FIRST, disc });
  }

  /** They lay the marched pictures over what was drawn before. */
  get overlays(): readonly Mesh[] {
    return [this.front.mesh, this.behind.mesh];
  }

  /** For surfaces, which the picture takes the place of. */
  get picture(): MarchedUniforms {
    return this.front.uniforms;
  }

  /** March what is in `scene`, at `scale` pixels to one of the picture, 0..1. */
  render(scene: Scene, eyes: Eyes, scale: number): void {
    drawEyes(this.renderer, scene, eyes, this.target, scale, ({ viewport }, part) => {
      this.frame.uEye.value.copy(viewport);
      this.frame.uPart.value.copy(part);
    });
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
    this.front.dispose();
    this.behind.dispose();
  }
}
