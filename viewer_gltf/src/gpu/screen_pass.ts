/** A fragment shader over a whole target, or over each eye's part of it. */
import {
  BufferAttribute,
  BufferGeometry,
  GLSL3,
  type IUniform,
  Mesh,
  NoBlending,
  Scene,
  ShaderMaterial,
  Vector4,
} from "three";
import { COMPOSITE_VERTEX } from "./shaders/sources";

type Defines = Record<string, number | string>;

export class ScreenPass<U extends Record<string, IUniform>> {
  readonly scene = new Scene();
  readonly material: ShaderMaterial;
  private readonly triangle = new BufferGeometry();
  /** The part of the target that is being drawn. */
  readonly uPart = { value: new Vector4() };

  constructor(
    fragmentShader: string,
    readonly uniforms: U,
    defines: Defines = {},
  ) {
    this.triangle.setAttribute(
      "position",
      new BufferAttribute(new Float32Array([-1, -1, 0, 3, -1, 0, -1, 3, 0]), 3),
    );
    this.material = new ShaderMaterial({
      glslVersion: GLSL3,
      vertexShader: COMPOSITE_VERTEX,
      fragmentShader,
      defines,
      depthTest: false,
      depthWrite: false,
      blending: NoBlending,
      uniforms: { ...uniforms, uPart: this.uPart },
    });
    const mesh = new Mesh(this.triangle, this.material);
    mesh.frustumCulled = false;
    this.scene.add(mesh);
  }

  /** @param value null: removes the define */
  define(name: string, value: number | null): void {
    const { defines } = this.material;
    if ((defines[name] ?? null) === value) return;
    if (value === null) delete defines[name];
    else defines[name] = value;
    this.material.needsUpdate = true;
  }

  dispose(): void {
    this.triangle.dispose();
    this.material.dispose();
  }
}
