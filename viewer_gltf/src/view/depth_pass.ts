/**
 * Depth of the opaque surfaces, which the ray-march needs as a texture. The surfaces are drawn a
 * second time for it, into a target as large as the picture (both eyes in a headset), only while
 * a volume is on screen: the picture itself keeps the browser's own anti-aliasing, and in WebXR
 * its frame buffer can't be read.
 */
import {
  type Camera,
  DepthTexture,
  DoubleSide,
  MeshBasicMaterial,
  NearestFilter,
  type Object3D,
  type Scene,
  UnsignedIntType,
  type WebGLRenderer,
  WebGLRenderTarget,
} from "three";

export class DepthPass {
  readonly texture = new DepthTexture(1, 1, UnsignedIntType);
  private readonly target: WebGLRenderTarget;
  private readonly material = new MeshBasicMaterial({ colorWrite: false, side: DoubleSide });

  constructor() {
    this.target = new WebGLRenderTarget(1, 1, {
      depthTexture: this.texture,
      minFilter: NearestFilter,
      magFilter: NearestFilter,
    });
  }

  /** `hidden` are the objects that are not opaque. Size in pixels of the frame buffer. */
  render(
    renderer: WebGLRenderer,
    scene: Scene,
    camera: Camera,
    hidden: readonly Object3D[],
    width: number,
    height: number,
  ): void {
    this.target.setSize(width, height);
    const visibility = hidden.map((object) => object.visible);
    for (const object of hidden) object.visible = false;
    const { background } = scene;
    const target = renderer.getRenderTarget();
    scene.background = null;
    scene.overrideMaterial = this.material;
    renderer.setRenderTarget(this.target);
    renderer.clear();
    renderer.render(scene, camera);
    renderer.setRenderTarget(target);
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
