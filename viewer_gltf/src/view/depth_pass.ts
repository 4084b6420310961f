/**
 * Depth of the opaque surfaces, which the ray-march needs as a texture. The surfaces are drawn a
 * second time for it, into a target as large as the picture (both eyes in a headset), only while
 * a volume is on screen: the picture itself keeps the browser's own anti-aliasing, and in WebXR
 * its frame buffer can't be read.
 */
import {
  DepthTexture,
  type Material,
  NearestFilter,
  type Object3D,
  type Scene,
  UnsignedIntType,
  type WebGLRenderer,
  WebGLRenderTarget,
} from "three";
import { depthMaterial } from "../mesh/blend";
import type { Cuts } from "./cuts";
import type { Eyes } from "./eyes";
import { drawEyes } from "./offscreen";

export class DepthPass {
  readonly texture = new DepthTexture(1, 1, UnsignedIntType);
  private readonly target: WebGLRenderTarget;
  private readonly material: Material;

  constructor({ uCuts, uCutCount }: Pick<Cuts, "uCuts" | "uCutCount">) {
    this.material = depthMaterial({ uCuts, uCutCount });
    this.target = new WebGLRenderTarget(1, 1, {
      depthTexture: this.texture,
      minFilter: NearestFilter,
      magFilter: NearestFilter,
    });
  }

  /** `hidden` are the objects that are not opaque. */
  render(renderer: WebGLRenderer, scene: Scene, eyes: Eyes, hidden: readonly Object3D[]): void {
    const visibility = hidden.map((object) => object.visible);
    for (const object of hidden) object.visible = false;
    const { background } = scene;
    scene.background = null;
    scene.overrideMaterial = this.material;
    drawEyes(renderer, scene, eyes, this.target, 1);
    scene.overrideMaterial = null;
    scene.background = background;
    hidden.forEach((object, i) => {
      object.visible = visibility[i];
    });
  }

  dispose(): void {
    this.target.dispose();
    this.texture.dispose();
    this.material.dispose();
  }
}
