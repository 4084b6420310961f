/**
 * The volumes' picture: marched into textures of its own, at as many pixels as the frame's budget
 * allows, and laid over the scene: what lies behind translucent surfaces before these are drawn,
 * the rest last of all.
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
  type Texture,
  Vector4,
  type WebGLRenderer,
  WebGLRenderTarget,
} from "three";
import { COMPOSITE_FRAGMENT, COMPOSITE_VERTEX } from "../shaders/texts";
import type { MarchFrame } from "../volume/tile_march";
import type { Eyes } from "./eyes";
import { drawEyes } from "./offscreen";

/** Order among all that is blended. */
const FIRST = -1000;
const LAST = 1000;

type Overlay = Mesh<BufferGeometry, ShaderMaterial>;

export class MarchPass {
  /** They lay the marched pictures over what was drawn before. */
  private readonly front: Overlay;
  private readonly behind: Overlay;
  private readonly target = new WebGLRenderTarget(1, 1, {
    count: 2,
    depthBuffer: false,
    minFilter: NearestFilter,
    magFilter: NearestFilter,
  });
  private readonly eyes = {
    uEyes: { value: [new Vector4(), new Vector4()] },
    uParts: { value: [new Vector4(), new Vector4()] },
    uEyeCount: { value: 1 },
  };

  constructor(private readonly frame: MarchFrame) {
    const triangle = new BufferGeometry();
    const corners = new Float32Array([-1, -1, 0, 3, -1, 0, -1, 3, 0]);
    triangle.setAttribute("position", new BufferAttribute(corners, 3));
    const overlay = (marched: Texture, order: number): Overlay => {
      const mesh = new Mesh(triangle, this.makeMaterial(marched));
      mesh.name = "volumes";
      mesh.frustumCulled = false;
      mesh.renderOrder = order;
      mesh.visible = false;
      return mesh;
    };
    this.front = overlay(this.target.textures[0], LAST);
    this.behind = overlay(this.target.textures[1], FIRST);
  }

  get overlays(): readonly Overlay[] {
    return [this.front, this.behind];
  }

  private makeMaterial(marched: Texture): ShaderMaterial {
    return new ShaderMaterial({
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
        ...this.eyes,
        uMarched: { value: marched },
        uSceneDepth: this.frame.uSceneDepth,
      },
    });
  }

  /** March what is in `scene`, at `scale` pixels to one of the picture, 0..1. */
  render(renderer: WebGLRenderer, scene: Scene, eyes: Eyes, scale: number): void {
    const { uEyes, uParts, uEyeCount } = this.eyes;
    uEyeCount.value = 0;
    drawEyes(renderer, scene, eyes, this.target, scale, ({ viewport }, part) => {
      this.frame.uEye.value.copy(viewport);
      this.frame.uPart.value.copy(part);
      uEyes.value[uEyeCount.value].copy(viewport);
      uParts.value[uEyeCount.value++].copy(part);
    });
    this.front.visible = true;
    this.behind.visible = this.frame.uHasPane.value;
  }

  /** Nothing is marched. */
  hide(): void {
    this.front.visible = this.behind.visible = false;
  }

  dispose(): void {
    this.target.dispose();
    this.front.geometry.dispose();
    for (const { material } of this.overlays) material.dispose();
  }
}
