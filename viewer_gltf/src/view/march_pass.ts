/**
 * The volumes' picture: marched into a texture of its own, at as many pixels as the frame's budget
 * allows, and laid over the scene by `overlay`, the last thing that is drawn of it.
 */
import {
  BufferAttribute,
  BufferGeometry,
  CustomBlending,
  GLSL3,
  Mesh,
  NearestFilter,
  OneFactor,
  OneMinusSrcAlphaFactor,
  type Scene,
  ShaderMaterial,
  Vector4,
  type WebGLRenderer,
  WebGLRenderTarget,
} from "three";
import { COMPOSITE_FRAGMENT, COMPOSITE_VERTEX } from "../shaders/texts";
import type { MarchFrame } from "../volume/tile_march";
import type { Eyes } from "./eyes";
import { drawEyes } from "./offscreen";

/** Behind everything else that is blended. */
const LAST = 1000;

export class MarchPass {
  /** Lays the marched picture over what was drawn before. */
  readonly overlay: Mesh<BufferGeometry, ShaderMaterial>;
  private readonly target = new WebGLRenderTarget(1, 1, {
    depthBuffer: false,
    minFilter: NearestFilter,
    magFilter: NearestFilter,
  });

  constructor(private readonly frame: MarchFrame) {
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
      uniforms: {
        uMarched: { value: this.target.texture },
        uSceneDepth: frame.uSceneDepth,
        uEyes: { value: [new Vector4(), new Vector4()] },
        uParts: { value: [new Vector4(), new Vector4()] },
        uEyeCount: { value: 1 },
      },
    });
    this.overlay = new Mesh(triangle, material);
    this.overlay.name = "volumes";
    this.overlay.frustumCulled = false;
    this.overlay.renderOrder = LAST;
    this.overlay.visible = false;
  }

  /** March what is in `scene`, at `scale` pixels to one of the picture, 0..1. */
  render(renderer: WebGLRenderer, scene: Scene, eyes: Eyes, scale: number): void {
    const { uEyes, uParts, uEyeCount } = this.overlay.material.uniforms;
    uEyeCount.value = 0;
    drawEyes(renderer, scene, eyes, this.target, scale, ({ viewport }, part) => {
      this.frame.uEye.value.copy(viewport);
      this.frame.uPart.value.copy(part);
      uEyes.value[uEyeCount.value].copy(viewport);
      uParts.value[uEyeCount.value++].copy(part);
    });
    this.overlay.visible = true;
  }

  dispose(): void {
    this.target.dispose();
    this.overlay.geometry.dispose();
    this.overlay.material.dispose();
  }
}
