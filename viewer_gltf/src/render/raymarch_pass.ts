/**
 * The volumes' picture: marched into textures of its own, at as many pixels as the frame's budget
 * allows, and laid over the scene: what lies behind translucent surfaces before these are drawn,
 * the rest last of all.
 */
import { type Mesh, NearestFilter, type Scene, type WebGLRenderer, WebGLRenderTarget } from "three";
import { FIRST, LAST, Overlay } from "../gpu/composite_pass";
import type { Eyes } from "../gpu/eyes";
import { drawEyes } from "../gpu/offscreen_target";
import type { MarchFrame } from "../volumes/tile_raymarch";

export class MarchPass {
  private readonly target = new WebGLRenderTarget(1, 1, {
    count: 2,
    depthBuffer: false,
    minFilter: NearestFilter,
    magFilter: NearestFilter,
  });
  private readonly front: Overlay;
  private readonly behind: Overlay;

  constructor(private readonly frame: MarchFrame) {
    this.front = new Overlay(this.target.textures[0], frame.uSceneDepth, LAST);
    this.behind = new Overlay(this.target.textures[1], frame.uSceneDepth, FIRST);
  }

  /** They lay the marched pictures over what was drawn before. */
  get overlays(): readonly Mesh[] {
    return [this.front.mesh, this.behind.mesh];
  }

  /** March what is in `scene`, at `scale` pixels to one of the picture, 0..1. */
  render(renderer: WebGLRenderer, scene: Scene, eyes: Eyes, scale: number): void {
    drawEyes(renderer, scene, eyes, this.target, scale, ({ viewport }, part) => {
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
