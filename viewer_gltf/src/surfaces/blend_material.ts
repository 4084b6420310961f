/**
 * Surfaces that give way to their volume: inside the disc, or as a whole, and surfaces that are
 * made translucent. Depth is written first, without colour, so that of a translucent surface only
 * what lies in front shows. Where a solid is cut open its inside is drawn as the plane of the cut:
 * flat, and lit as that.
 */
import {
  AlwaysStencilFunc,
  CustomBlending,
  DoubleSide,
  GLSL3,
  Mesh,
  type MeshStandardMaterial,
  NormalBlending,
  type Object3D,
  OneFactor,
  ReplaceStencilOp,
  ShaderMaterial,
  SrcAlphaFactor,
  ZeroFactor,
} from "three";
import type { Cuts } from "../gpu/clip_planes";
import { type Disc, LAID, type MarchedUniforms } from "../gpu/composite_pass";
import { CHUNKS } from "../gpu/glsl_chunks";
import { includeChunks } from "../gpu/glsl_include";

/**
 * What all surfaces share, by reference: the disc's cone and the cuts in the room, metres, and the
 * volumes' picture, which takes their place in the disc.
 */
export type SurfaceFrame = Pick<Disc, "uDisc" | "uApex" | "uAxis"> &
  Pick<Cuts, "uCuts" | "uCutCount"> &
  MarchedUniforms;

export function makeSurfaceFrame(
  { uDisc, uApex, uAxis }: Disc,
  picture: MarchedUniforms,
  { uCuts, uCutCount }: Pick<Cuts, "uCuts" | "uCutCount">,
): SurfaceFrame {
  return { uDisc, uApex, uAxis, uCuts, uCutCount, ...picture };
}

/**
 * A surface that is not opaque now; a pane: the march has to know what lies behind it. `isSolid`: but for
 * what its volume takes in the disc it is opaque.
 */
export type BlendedScene = Readonly<{ scene: Object3D; isPane: boolean; isSolid: boolean }>;

/** How much of a surface is left. */
export type Share = Readonly<{
  opacity: number;
  /** What its volume takes, 0..1: in the disc, or everywhere. */
  taken: number;
  isInDisc: boolean;
  /** Whether the volumes' picture is mixed with the surfaces' in the disc. */
  isCrossing: boolean;
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
uniform bool uCrosses;
#include <chunks/focus_disc>
// What the volume takes of the surface here, 0..1.
float shareTaken() {
  return uTaken * (uInDisc ? discWeight(vRoom, uApex, uAxis, uDisc) : 1.0);
}
// One that is mixed with its volume's picture is drawn also where that has taken all of it.
bool isGone() {
  return uOpacity <= 0.0 || (!uCrosses && shareTaken() >= 1.0);
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

/** The picture of the volumes. */
const MARCHED = `${includeChunks("#include <chunks/marched_light>", CHUNKS)}\n`;
/**
 * Light, and in place of opacity the share that is left of what lies behind. In the disc both
 * pictures, of surface and of volume, are mixed: one laid over the other would be dark between.
 */
const BLENDED = `
#ifndef OPAQUE
  float taken = shareTaken();
  float own = uOpacity * diffuseColor.a;
  gl_FragColor = vec4(own * (1.0 - taken) * gl_FragColor.rgb, 1.0 - own * (1.0 - taken));
  if (uCrosses && taken > 0.0) {
    vec4 volume = marchedLight(gl_FragCoord.xy);
    gl_FragColor.rgb += taken * volume.rgb;
    gl_FragColor.a = (1.0 - taken) * (1.0 - own) + taken * (1.0 - volume.a);
  }
#endif
`;

/** Before the depth of surfaces without a share, after all opaque ones. */
const AFTER_OPAQUE = 1;

/** The layer in which only what writes the depth of translucent surfaces is; WebXR has 1 and 2. */
export const PANES = 3;

/** Blending of light with the share that is left of what lies behind, and the mark of it. */
const LEAVES_A_SHARE = {
  blendSrc: OneFactor,
  blendDst: SrcAlphaFactor,
  blendSrcAlpha: ZeroFactor,
  blendDstAlpha: OneFactor,
  stencilRef: LAID,
  stencilFunc: AlwaysStencilFunc,
  stencilZPass: ReplaceStencilOp,
} as const;

export class BlendedSurface {
  private readonly uniforms;
  private readonly depth: ShaderMaterial;
  private readonly twins: Mesh[] = [];
  isBlended = false;
  isPane = false;
  isSolid = false;

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
      uCrosses: { value: false },
    };
    for (const material of materials) {
      this.patch(material);
      material.forceSinglePass = true; // the depth that is written first sorts both sides
      Object.assign(material, LEAVES_A_SHARE);
    }
    this.depth = depthMaterial(this.uniforms, "if (isGone()) discard;");
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
      shader.fragmentShader = (DECLARED + MARCHED + shader.fragmentShader)
        .replace("#include <dithering_fragment>", `${BLENDED}\n#include <dithering_fragment>`)
        .replace(
          "#include <color_fragment>",
          "#include <color_fragment>\n\tif (isGone() || isCut(vRoom)) discard;",
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

  set({ opacity, taken, isInDisc, isCrossing }: Share): void {
    const crosses = isInDisc && isCrossing;
    this.uniforms.uOpacity.value = opacity;
    this.uniforms.uTaken.value = taken;
    this.uniforms.uInDisc.value = isInDisc;
    this.uniforms.uCrosses.value = crosses;
    this.isBlended = opacity < 1 || taken > 0;
    this.isPane = this.isBlended && !crosses;
    this.isSolid = isInDisc && opacity === 1;
    this.scene.visible = opacity > 0 && (taken < 1 || isInDisc);
    for (const material of this.materials) {
      material.stencilWrite = crosses && this.isBlended;
      if (material.transparent === this.isBlended) continue;
      material.transparent = this.isBlended;
      material.blending = this.isBlended ? CustomBlending : NormalBlending;
      material.needsUpdate = true; // an opaque surface's shader leaves its alpha out
    }
    for (const twin of this.twins) {
      twin.visible = this.isBlended;
      if (this.isPane) twin.layers.enable(PANES);
      else twin.layers.disable(PANES);
    }
  }

  dispose(): void {
    this.depth.dispose();
  }
}
