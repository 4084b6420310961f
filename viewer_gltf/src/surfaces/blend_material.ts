/**
 * Surfaces that give way to their volume: inside the disc, or as a whole, and surfaces that are
 * made translucent. Depth is written first, without colour, so that of a translucent surface only
 * what lies in front shows. Where a solid is cut open its inside is drawn as the plane of the cut:
 * flat, and lit as that.
 */
import {
  DoubleSide,
  GLSL3,
  Mesh,
  type MeshStandardMaterial,
  type Object3D,
  ShaderMaterial,
  type Vector2,
  Vector3,
  type Vector4,
} from "three";
import type { Cuts } from "../gpu/clip_planes";
import { CHUNKS } from "../gpu/glsl_chunks";
import { includeChunks } from "../gpu/glsl_include";

/** What all surfaces share, by reference: the disc's cone and the cuts in the room, metres. */
export type SurfaceFrame = Readonly<{
  uDisc: { value: Vector2 };
  uApex: { value: Vector3 };
  uAxis: { value: Vector3 };
  uCuts: { value: Vector4[] };
  uCutCount: { value: number };
}>;

export function makeSurfaceFrame(uDisc: { value: Vector2 }, cuts: Cuts): SurfaceFrame {
  const { uCuts, uCutCount } = cuts;
  const uAxis = { value: new Vector3(0, 0, -1) };
  return { uDisc, uApex: { value: new Vector3() }, uAxis, uCuts, uCutCount };
}

/** How much of a surface is left. */
export type Share = Readonly<{
  opacity: number;
  /** What its volume takes, 0..1: in the disc, or everywhere. */
  taken: number;
  isInDisc: boolean;
}>;

const VARYING = "varying vec3 vRoom;\n";
const DECLARED = includeChunks(
  `varying vec3 vRoom;
#include <chunks/clip_planes>
uniform vec2 uDisc;
uniform vec3 uApex;
uniform vec3 uAxis;
uniform float uOpacity;
uniform float uTaken;
uniform bool uInDisc;
#include <chunks/focus_disc>
float shareLeft() {
  float w = uInDisc ? discWeight(vRoom, uApex, uAxis, uDisc) : 1.0;
  return uOpacity * (1.0 - uTaken * w);
}
`,
  CHUNKS,
);

/**
 * Writes depth alone, cut as the surfaces are.
 *
 * @param condition statement that may discard; knows `vRoom`
 */
export function depthMaterial(
  uniforms: Record<string, { value: unknown }>,
  condition = "",
): ShaderMaterial {
  return new ShaderMaterial({
    glslVersion: GLSL3,
    colorWrite: false,
    side: DoubleSide,
    uniforms,
    vertexShader: `out vec3 vRoom;
void main() {
  vec3 transformed = position;
  vRoom = (modelMatrix * vec4(transformed, 1.0)).xyz;
  vec4 mvPosition = modelViewMatrix * vec4(transformed, 1.0);
  gl_Position = projectionMatrix * mvPosition;
}`,
    fragmentShader: `${DECLARED.replace("varying", "in")}
out vec4 oColor;
void main() {
  if (isCut(vRoom)) discard;
  ${condition}
  oColor = vec4(0.0);
}`,
  });
}

/** Before the depth of surfaces without a share, after all opaque ones. */
const AFTER_OPAQUE = 1;

/** The layer in which only what writes the depth of translucent surfaces is; WebXR has 1 and 2. */
export const PANES = 3;

export class BlendedSurface {
  private readonly uniforms;
  private readonly depth: ShaderMaterial;
  private readonly twins: Mesh[] = [];
  isBlended = false;

  constructor(
    private readonly scene: Object3D,
    private readonly materials: readonly MeshStandardMaterial[],
    frame: SurfaceFrame,
  ) {
    this.uniforms = {
      ...frame,
      uOpacity: { value: 1 },
      uTaken: { value: 0 },
      uInDisc: { value: false },
    };
    for (const material of materials) {
      this.patch(material);
      material.forceSinglePass = true; // the depth that is written first sorts both sides
    }
    this.depth = depthMaterial(this.uniforms, "if (shareLeft() <= 0.0) discard;");
    // A hair behind the colour that follows, whatever its rounding; not by slope, which would let
    // what lies behind a rim through.
    this.depth.polygonOffset = true;
    this.depth.polygonOffsetFactor = 0;
    this.depth.polygonOffsetUnits = 2;
    const meshes: Mesh[] = [];
    scene.traverse((object) => {
      if (object instanceof Mesh) meshes.push(object);
    });
    for (const mesh of meshes) {
      const twin = new Mesh(mesh.geometry, this.depth);
      twin.renderOrder = AFTER_OPAQUE;
      twin.visible = false;
      twin.layers.enable(PANES);
      mesh.add(twin);
      this.twins.push(twin);
    }
  }

  private patch(material: MeshStandardMaterial): void {
    material.onBeforeCompile = (shader) => {
      Object.assign(shader.uniforms, this.uniforms);
      shader.vertexShader = (VARYING + shader.vertexShader).replace(
        "#include <project_vertex>",
        "#include <project_vertex>\n\tvRoom = (modelMatrix * vec4(transformed, 1.0)).xyz;",
      );
      shader.fragmentShader = (DECLARED + shader.fragmentShader)
        .replace(
          "#include <color_fragment>",
          "#include <color_fragment>\n\tdiffuseColor.a *= shareLeft();\n" +
            "\tif (diffuseColor.a <= 0.0 || isCut(vRoom)) discard;",
        )
        .replace(
          "#include <normal_fragment_maps>",
          "#include <normal_fragment_maps>\n\tif (uCutCount > 0 && !gl_FrontFacing) {\n" +
            "\t\tvec3 flatNormal = cutNormal(cameraPosition, vRoom);\n" +
            "\t\tif (flatNormal != vec3(0.0)) {\n" +
            "\t\t\tnormal = normalize((viewMatrix * vec4(flatNormal, 0.0)).xyz);\n\t\t}\n\t}",
        );
    };
    material.customProgramCacheKey = () => "blended";
  }

  set({ opacity, taken, isInDisc }: Share): void {
    this.uniforms.uOpacity.value = opacity;
    this.uniforms.uTaken.value = taken;
    this.uniforms.uInDisc.value = isInDisc;
    this.isBlended = opacity < 1 || taken > 0;
    this.scene.visible = opacity > 0 && (taken < 1 || isInDisc);
    for (const material of this.materials) {
      if (material.transparent === this.isBlended) continue;
      material.transparent = this.isBlended;
      material.needsUpdate = true; // an opaque surface's shader leaves its alpha out
    }
    for (const twin of this.twins) twin.visible = this.isBlended;
  }

  dispose(): void {
    this.depth.dispose();
  }
}
