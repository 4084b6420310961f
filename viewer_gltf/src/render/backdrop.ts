/**
 * The backdrop of the specimen on a flat screen: a gentle gradient, a pool of light on the ground,
 * and a soft shadow under the specimen. It is drawn behind everything. In stereo the scene is dark
 * with a grid on the ground, or the user's own room.
 */
import {
  BufferAttribute,
  BufferGeometry,
  Color,
  GLSL3,
  Mesh,
  NoColorSpace,
  RawShaderMaterial,
  Vector3,
  Vector4,
} from "three";
import { declareCovering } from "../gpu/has_edges";
import { BACKDROP_FRAGMENT, BACKDROP_VERTEX } from "../gpu/shaders/backdrop_sources";
import { around } from "../math/box";
import type { Vec3 } from "../math/vec3";
import { FAR, type Theme } from "./theme";

/** Distance of the ground below the specimen, as a share of the specimen's height. */
const GAP = 0.02;
/** Draw order: before everything else. */
const RENDER_ORDER = -2;

/**
 * sRGB colours high up and beside the specimen, and the share of the light that the shadow takes.
 */
const THEMES = {
  dark: [0x171c26, 0x1f2632, 0.7],
  light: [0xfafbfd, 0xffffff, 0.3],
} as const;

export class Backdrop {
  private readonly uniforms = {
    uFar: { value: new Vector3() },
    uHigh: { value: new Vector3() },
    uPool: { value: new Vector3() },
    uShade: { value: 0 },
    uFoot: { value: new Vector4() },
    uGround: { value: 0 },
  };
  readonly mesh = new Mesh(
    new BufferGeometry(),
    new RawShaderMaterial({
      glslVersion: GLSL3,
      vertexShader: BACKDROP_VERTEX,
      fragmentShader: BACKDROP_FRAGMENT,
      uniforms: this.uniforms,
      depthTest: false,
      depthWrite: false,
    }),
  );

  /** Share of the light that the shadow takes, 0 to 1. */
  private shade = 0;
  /** True if nothing is shown, so that there is no shadow. */
  private isEmpty = false;

  constructor() {
    const corners = new Float32Array([-1, -1, 0, 3, -1, 0, -1, 3, 0]);
    this.mesh.geometry.setAttribute("position", new BufferAttribute(corners, 3));
    this.mesh.frustumCulled = false;
    this.mesh.renderOrder = RENDER_ORDER;
    declareCovering(this.mesh);
  }

  setTheme(theme: Theme): void {
    const [high, pool, shade] = THEMES[theme];
    const { uFar, uHigh, uPool, uShade } = this.uniforms;
    uFar.value.copy(srgb(FAR[theme]));
    uHigh.value.copy(srgb(high));
    uPool.value.copy(srgb(pool));
    this.shade = shade;
    uShade.value = this.isEmpty ? 0 : shade;
  }

  /**
   * Fits ground and shadow to the specimen.
   * @param points outermost points of what is shown of the specimen, in metres of the scene; empty:
   * no shadow
   */
  fitTo(points: readonly Vec3[]): void {
    this.isEmpty = points.length === 0;
    this.uniforms.uShade.value = this.isEmpty ? 0 : this.shade;
    if (this.isEmpty) return;
    const { min, max } = around(points);
    this.uniforms.uFoot.value.set(min[0], min[2], max[0], max[2]);
    this.uniforms.uGround.value = min[1] - GAP;
  }

  dispose(): void {
    this.mesh.removeFromParent();
    this.mesh.geometry.dispose();
    this.mesh.material.dispose();
  }
}

function srgb(hex: number): Vector3 {
  return new Vector3(...new Color().setHex(hex, NoColorSpace).toArray());
}
