/** Composites an image, drawn with as many or fewer pixels, over the scene, eye by eye. */
import {
  BufferAttribute,
  BufferGeometry,
  CustomBlending,
  GLSL3,
  Matrix4,
  Mesh,
  NotEqualStencilFunc,
  OneFactor,
  OneMinusSrcAlphaFactor,
  ShaderMaterial,
  type Texture,
  type Vector2,
  Vector3,
  Vector4,
} from "three";
import type { Eyes } from "./eyes";
import { declareCovering } from "./has_edges";
import { partOf } from "./offscreen_target";
import { COMPOSITE_FRAGMENT, COMPOSITE_VERTEX } from "./shaders/sources";

/** Draw orders: first and last among all blended objects. */
export const FIRST = -1000;
export const LAST = 1000;
/**
 * Stencil value of pixels at which a surface has already composited the volume that replaces it.
 */
export const VOLUME_DRAWN = 1;

/** Uniforms of `chunks/marched_light`, shared by reference. */
export function marchedUniforms(image: Texture, uSceneDepth: { value: Texture }) {
  return {
    uMarched: { value: image },
    uSceneDepth,
    uEyes: { value: [new Vector4(), new Vector4()] },
    uParts: { value: [new Vector4(), new Vector4()] },
    uEyeCount: { value: 1 },
  };
}
export type MarchedUniforms = ReturnType<typeof marchedUniforms>;

/** The focus disc in the scene, shared by reference; inside it the image replaces surfaces. */
export type Disc = Readonly<{
  uIsCrossing: { value: boolean };
  uApex: { value: Vector3 };
  uAxis: { value: Vector3 };
  uDisc: { value: Vector2 };
  /**
   * Distance from the eye, metres, of the point on a pixel's ray at which the disc's weight is
   * computed.
   */
  uRim: { value: number };
}>;

export type OverlayOptions = Readonly<{
  order: number;
  /**
   * Whether the image's colours are encoded before premultiplication; otherwise they are linear.
   */
  isEncoded?: boolean;
  disc?: Disc;
}>;

export class Overlay {
  readonly mesh: Mesh<BufferGeometry, ShaderMaterial>;
  readonly uniforms: MarchedUniforms;
  private readonly rays = {
    uToScene: { value: [new Matrix4(), new Matrix4()] },
    uEyeAt: { value: [new Vector3(), new Vector3()] },
  };

  /** @param image premultiplied */
  constructor(
    image: Texture,
    uSceneDepth: { value: Texture },
    { order, isEncoded = false, disc }: OverlayOptions,
  ) {
    this.uniforms = marchedUniforms(image, uSceneDepth);
    const triangle = new BufferGeometry();
    const corners = new Float32Array([-1, -1, 0, 3, -1, 0, -1, 3, 0]);
    triangle.setAttribute("position", new BufferAttribute(corners, 3));
    const material = new ShaderMaterial({
      glslVersion: GLSL3,
      vertexShader: COMPOSITE_VERTEX,
      fragmentShader: COMPOSITE_FRAGMENT,
      defines: { ...(isEncoded ? { ENCODED: 1 } : {}), ...(disc ? { CROSSING: 1 } : {}) },
      depthTest: false,
      depthWrite: false,
      transparent: true,
      blending: CustomBlending,
      blendSrc: OneFactor,
      blendDst: OneMinusSrcAlphaFactor,
      stencilWrite: disc !== undefined, // switches on the stencil test in three.js
      stencilWriteMask: 0,
      stencilRef: VOLUME_DRAWN,
      stencilFunc: NotEqualStencilFunc,
      uniforms: { ...this.uniforms, ...this.rays, ...disc },
    });
    this.mesh = new Mesh(triangle, material);
    this.mesh.name = "volumes";
    this.mesh.frustumCulled = false;
    this.mesh.renderOrder = order;
    this.mesh.visible = false;
    declareCovering(this.mesh);
  }

  /**
   * Shows the image drawn for these eyes, with `scale` pixels for each pixel of the frame along an
   * edge.
   */
  show(eyes: Eyes, scale: number): void {
    const { uEyes, uParts, uEyeCount } = this.uniforms;
    const { uToScene, uEyeAt } = this.rays;
    uEyeCount.value = eyes.all.length;
    eyes.all.slice(0, 2).forEach((eye, i) => {
      const { matrixWorld, projectionMatrixInverse } = eye.camera;
      uEyes.value[i].copy(eye.viewport);
      partOf(eye, scale, uParts.value[i]);
      uToScene.value[i].multiplyMatrices(matrixWorld, projectionMatrixInverse);
      uEyeAt.value[i].setFromMatrixPosition(matrixWorld);
    });
    this.mesh.visible = true;
  }

  hide(): void {
    this.mesh.visible = false;
  }

  dispose(): void {
    this.mesh.geometry.dispose();
    this.mesh.material.dispose();
  }
}
