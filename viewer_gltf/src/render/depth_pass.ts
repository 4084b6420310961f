/**
 * Depth of the surfaces as textures for the ray march, opaque and translucent ones separately.
 *
 * The surfaces are drawn a second time, into a target as large as the frame (both eyes in a
 * headset), and only while a volume is on screen. The frame itself keeps the browser's
 * anti-aliasing, and in WebXR its frame buffer can't be read.
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
import { BothEyes } from "../gpu/both_eyes";
import type { Cuts } from "../gpu/clip_planes";
import type { Eyes } from "../gpu/eyes";
import { drawAllEyes } from "../gpu/offscreen_target";
import { depthMaterial, PANES } from "./blend_material";

export class DepthPass {
  private readonly solid = depthTarget();
  private readonly panes = depthTarget();
  private readonly material: Material;

  constructor(
    { uCuts, uCutCount }: Pick<Cuts, "uCuts" | "uCutCount">,
    private readonly both = new BothEyes(),
  ) {
    this.material = depthMaterial({ uCuts, uCutCount, ...both.uniforms }, both);
  }

  get texture(): DepthTexture {
    return this.solid.depthTexture;
  }

  get paneTexture(): DepthTexture {
    return this.panes.depthTexture;
  }

  /**
   * Draws the depth of opaque surfaces.
   * @param hidden the objects that are not opaque
   */
  render(renderer: WebGLRenderer, scene: Scene, eyes: Eyes, hidden: readonly Object3D[]): void {
    const visibility = hidden.map((object) => object.visible);
    for (const object of hidden) object.visible = false;
    scene.overrideMaterial = this.material;
    withoutBackground(scene, () =>
      drawAllEyes(renderer, scene, eyes, this.both.cameraOf(eyes), this.solid),
    );
    scene.overrideMaterial = null;
    hidden.forEach((object, i) => {
      object.visible = visibility[i];
    });
  }

  /** Draws the depth of translucent surfaces, which have depth materials of their own. */
  renderPanes(renderer: WebGLRenderer, scene: Scene, eyes: Eyes): void {
    withoutBackground(scene, () =>
      drawAllEyes(renderer, scene, eyes, this.both.cameraOf(eyes, PANES), this.panes),
    );
  }

  dispose(): void {
    for (const target of [this.solid, this.panes]) {
      target.depthTexture.dispose();
      target.dispose();
    }
    this.material.dispose();
  }
}

function withoutBackground(scene: Scene, draw: () => void): void {
  const { background } = scene;
  scene.background = null;
  draw();
  scene.background = background;
}

function depthTarget(): WebGLRenderTarget & { depthTexture: DepthTexture } {
  const depthTexture = new DepthTexture(1, 1, UnsignedIntType);
  const filters = { minFilter: NearestFilter, magFilter: NearestFilter } as const;
  return Object.assign(new WebGLRenderTarget(1, 1, { depthTexture, ...filters }), { depthTexture });
}
