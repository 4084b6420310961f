/**
 * Depth of the surfaces, of opaque and of translucent ones apart, which the ray-march needs as
 * textures. The surfaces are drawn a second time for it, into a target as large as the picture (both eyes in a headset), only while
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
import { BothEyes } from "../gpu/both_eyes";
import type { Cuts } from "../gpu/clip_planes";
import type { Eyes } from "../gpu/eyes";
import { drawAllEyes } from "../gpu/offscreen_target";
import { depthMaterial, PANES } from "./blend_material";

export class DepthPass {
  /** Of what is opaque. */
  private readonly solid = depthTarget();
  /** Of what is translucent. */
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

  /** `hidden` are the objects that are not opaque. */
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

  /** Of translucent surfaces: they have their own way to write depth alone. */
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
