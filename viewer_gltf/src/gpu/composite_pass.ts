/** Lays a picture, which was drawn at fewer pixels or as many, over the scene, eye by eye. */
import {
  BufferAttribute,
  BufferGeometry,
  CustomBlending,
  GLSL3,
  Mesh,
  OneFactor,
  OneMinusSrcAlphaFactor,
  ShaderMaterial,
  type Texture,
  Vector4,
} from "three";
import type { Eyes } from "./eyes";
import { partOf } from "./offscreen_target";
import { COMPOSITE_FRAGMENT, COMPOSITE_VERTEX } from "./shaders/sources";

/** Render order of the pass: first among all that is blended. */
export const FIRST = -1000;
export const LAST = 1000;

export class Overlay {
  readonly mesh: Mesh<BufferGeometry, ShaderMaterial>;
  private readonly eyes = {
    uEyes: { value: [new Vector4(), new Vector4()] },
    uParts: { value: [new Vector4(), new Vector4()] },
    uEyeCount: { value: 1 },
  };

  /** @param picture encoded, premultiplied */
  constructor(picture: Texture, uSceneDepth: { value: Texture }, order: number) {
    const triangle = new BufferGeometry();
    const corners = new Float32Array([-1, -1, 0, 3, -1, 0, -1, 3, 0]);
    triangle.setAttribute("position", new BufferAttribute(corners, 3));
    const material = new ShaderMaterial({
      glslVersion: GLSL3,
      vertexShader: COMPOSITE_VERTEX,
      fragmentShader: COMPOSITE_FRAGMENT,
      depthTest: false,
      depthWrite: false,
      transparent: true,
      blending: CustomBlending,
      blendSrc: OneFactor,
      blendDst: OneMinusSrcAlphaFactor,
      uniforms: { ...this.eyes, uMarched: { value: picture }, uSceneDepth },
    });
    this.mesh = new Mesh(triangle, material);
    this.mesh.name = "volumes";
    this.mesh.frustumCulled = false;
    this.mesh.renderOrder = order;
    this.mesh.visible = false;
  }

  /** Show what was drawn for these eyes, at `scale` pixels to one of theirs. */
  show(eyes: Eyes, scale: number): void {
    const { uEyes, uParts, uEyeCount } = this.eyes;
    uEyeCount.value = eyes.all.length;
    eyes.all.slice(0, 2).forEach((eye, i) => {
      uEyes.value[i].copy(eye.viewport);
      partOf(eye, scale, uParts.value[i]);
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
