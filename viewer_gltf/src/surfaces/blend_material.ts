/**
 * Surfaces that give way to their volume: inside the disc, or as a whole, and surfaces that are
 * made translucent. Depth is written first, without colour, so that of a translucent surface only
 * what lies in front shows. Where a solid is cut open, or ends at the tile that is a volume, its inside
 * is drawn as the plane there: flat, and lit as that.
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
  OneMinusSrcAlphaFactor,
  ReplaceStencilOp,
  ShaderMaterial,
} from "three";
import {
  type BothEyes,
  type BothEyesUniforms,
  NOT_THE_OTHERS,
  NOT_THE_OTHERS_DECLARED,
  TO_EACH_EYE,
  TO_EACH_EYE_DECLARED,
} from "../gpu/both_eyes";
import type { Cuts } from "../gpu/clip_planes";
import { type Disc, LAID, type MarchedUniforms } from "../gpu/composite_pass";
import { CHUNKS } from "../gpu/glsl_chunks";
import { includeChunks } from "../gpu/glsl_include";

/**
 * What all surfaces share, by reference: the disc's cone and the cuts in the room, metres, and the
 * volumes' picture, which takes their place in the disc.
 */
export type SurfaceFrame = Readonly<{
  uniforms: Pick<Disc, "uDisc" | "uApex" | "uAxis"> &
    Pick<Cuts, "uCuts" | "uCutCount" | "uOpen"> &
    MarchedUniforms &
    BothEyesUniforms;
  both: BothEyes;
}>;

export function makeSurfaceFrame(
  { uDisc, uApex, uAxis }: Disc,
  picture: MarchedUniforms,
  { uCuts, uCutCount, uOpen }: Pick<Cuts, "uCuts" | "uCutCount" | "uOpen">,
  both: BothEyes,
): SurfaceFrame {
  const shared = { uDisc, uApex, uAxis, uCuts, uCutCount, uOpen };
  return { uniforms: { ...shared, ...picture, ...both.uniforms }, both };
}

/**
 * A surface that is not opaque now; a pane: the march has to know what lies behind it. `isSolid`: but for
 * what its volume takes in the disc it is opaque.
 */
export type BlendedScene = Readonly<{ scene: Object3D; isPane: boolean; isSolid: boolean }>;

/**
 * What some surfaces have beside all others, as text in their shaders. `place` may move `transformed`,
 * `end` changes `gl_Position`, `color` changes `diffuseColor`.
 */
export type SurfacePart = Readonly<{
  /** Of the text: the same for the same one. */
  key: string;
  uniforms: Readonly<Record<string, { value: unknown }>>;
  vertex: Readonly<{ declared: string; place: string; end: string }>;
  fragment: Readonly<{ declared: string; color: string }>;
}>;

/** How much of a surface is left. */
export type Share = Readonly<{
  opacity: number;
  /** What its volume takes, 0..1: in the disc, or everywhere. */
  taken: number;
  isInDisc: boolean;
  /** Whether the volumes' picture is mixed with the surfaces' in the disc. */
  isCrossing: boolean;
  /** Of the shown channels: where two surfaces lie in one place, as where the data end, the first shows. */
  rank: number;
}>;

/**
 * Of depth, between one channel and the next: more than coordinates differ by that are quantized apart; about
 * a millimetre of a specimen that is 1.2 m long in the room.
 */
const UNITS_APART = 32;
/** Units of depth between a translucent surface's colour and the pass that writes its depth before. */
const UNITS_BEHIND = 2;

const NO_PART: Pick<SurfacePart, "uniforms" | "vertex" | "fragment"> = {
  uniforms: {},
  vertex: { declared: "", place: "", end: "" },
  fragment: { declared: "", color: "" },
};

const VARYINGS = "varying vec3 vRoom;\n";
const DECLARED = includeChunks(
  `${VARYINGS}${NOT_THE_OTHERS_DECLARED}
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
 * @param uniforms with those of `both`
 * @param condition statement that may discard; knows `vRoom`
 */
export function depthMaterial(
  uniforms: Record<string, { value: unknown }>,
  both: BothEyes,
  condition = "",
): ShaderMaterial {
  const material = new ShaderMaterial({
    glslVersion: GLSL3,
    colorWrite: false,
    side: DoubleSide,
    uniforms,
    vertexShader: `${VARYINGS}${TO_EACH_EYE_DECLARED}
void main() {
  vec3 transformed = position;
  vRoom = (modelMatrix * vec4(transformed, 1.0)).xyz;
  vec4 mvPosition = modelViewMatrix * vec4(transformed, 1.0);
  gl_Position = projectionMatrix * mvPosition;
  ${TO_EACH_EYE}
}`,
    fragmentShader: `${DECLARED}
out vec4 oColor;
void main() {
  ${NOT_THE_OTHERS}
  if (isCut(vRoom)) discard;
  ${condition}
  oColor = vec4(0.0);
}`,
  });
  both.adopt(material);
  return material;
}

const OPENED = includeChunks("#include <chunks/open_tile>\n", CHUNKS);
/** The picture of the volumes. */
const MARCHED = `${includeChunks("#include <chunks/marched_light>", CHUNKS)}\n`;
/**
 * Light, times its opacity. In the disc both pictures, of surface and of volume, are mixed: one laid over
 * the other would be dark between.
 */
const BLENDED = `
#ifndef OPAQUE
  float taken = shareTaken();
  float own = uOpacity * diffuseColor.a;
  gl_FragColor = vec4(own * (1.0 - taken) * gl_FragColor.rgb, own * (1.0 - taken));
  if (uCrosses && taken > 0.0) {
    vec4 volume = marchedLight(gl_FragCoord.xy);
    gl_FragColor += taken * volume;
  }
#endif
`;

/** Before the depth of surfaces without a share, after all opaque ones. */
const AFTER_OPAQUE = 1;

/** The layer in which only what writes the depth of translucent surfaces is; WebXR has 1 and 2. */
export const PANES = 3;

/** Blending of light that has its opacity already, and the mark of it. */
const LAID_OVER = {
  blendSrc: OneFactor,
  blendDst: OneMinusSrcAlphaFactor,
  stencilRef: LAID,
  stencilFunc: AlwaysStencilFunc,
  stencilZPass: ReplaceStencilOp,
} as const;

export class BlendedSurface {
  private readonly uniforms;
  private readonly depth: ShaderMaterial;
  private readonly twins: readonly Mesh[];
  private part: SurfacePart | null = null;
  isBlended = false;
  isPane = false;
  isSolid = false;

  constructor(
    private readonly scene: Object3D,
    private readonly materials: readonly MeshStandardMaterial[],
    { uniforms, both }: SurfaceFrame,
  ) {
    this.uniforms = {
      ...uniforms,
      uOpacity: { value: 1 },
      uTaken: { value: 0 },
      uInDisc: { value: false },
      uCrosses: { value: false },
    };
    for (const material of materials) {
      this.patch(material);
      both.adopt(material);
      material.forceSinglePass = true; // the depth that is written first sorts both sides
      Object.assign(material, LAID_OVER);
    }
    this.depth = depthMaterial(this.uniforms, both, "if (isGone()) discard;");
    // A hair behind the colour that follows, whatever its rounding; not by slope, which would let
    // what lies behind a rim through.
    for (const material of [...materials, this.depth]) {
      material.polygonOffset = true;
      material.polygonOffsetFactor = 0;
    }
    const meshes: Mesh[] = [];
    scene.traverse((object) => {
      if (object instanceof Mesh) meshes.push(object);
    });
    this.twins = meshes.map((mesh) => {
      const twin = new Mesh(mesh.geometry, this.depth);
      twin.renderOrder = AFTER_OPAQUE;
      twin.visible = false;
      mesh.add(twin);
      return twin;
    });
  }

  private patch(material: MeshStandardMaterial): void {
    material.onBeforeCompile = (shader) => {
      const { vertex, fragment, uniforms } = this.part ?? NO_PART;
      Object.assign(shader.uniforms, this.uniforms, uniforms);
      const declared = VARYINGS + TO_EACH_EYE_DECLARED + vertex.declared;
      shader.vertexShader = (declared + shader.vertexShader).replace(
        "#include <project_vertex>",
        `${vertex.place}\n#include <project_vertex>\n\tvRoom = (modelMatrix * vec4(transformed, 1.0)).xyz;` +
          TO_EACH_EYE +
          vertex.end,
      );
      shader.fragmentShader = (
        DECLARED +
        OPENED +
        MARCHED +
        fragment.declared +
        shader.fragmentShader
      )
        .replace("#include <dithering_fragment>", `${BLENDED}\n#include <dithering_fragment>`)
        .replace(
          "#include <color_fragment>",
          `#include <color_fragment>\n${fragment.color}${NOT_THE_OTHERS}\tif (isGone() || isCut(vRoom)) discard;`,
        )
        .replace(
          "#include <normal_fragment_maps>",
          "#include <normal_fragment_maps>\n\tif (!gl_FrontFacing) {\n" +
            "\t\tvec3 flatNormal = cutNormal(cameraPosition, vRoom);\n" +
            "\t\tif (flatNormal == vec3(0.0)) flatNormal = openNormal(cameraPosition, vRoom);\n" +
            "\t\tif (flatNormal != vec3(0.0)) {\n" +
            "\t\t\tnormal = normalize((viewMatrix * vec4(flatNormal, 0.0)).xyz);\n\t\t}\n\t}",
        );
    };
    material.customProgramCacheKey = () => `blended ${this.part?.key}`;
  }

  /** Have a part from now on. */
  wear(part: SurfacePart): void {
    this.part = part;
    const { declared, place, end } = part.vertex;
    const { depth } = this;
    Object.assign(depth.uniforms, part.uniforms);
    depth.vertexShader = (declared + depth.vertexShader)
      .replace("vec3 transformed = position;", (found) => `${found}\n${place}`)
      .replace(/}$/, `${end}}`);
    for (const material of [...this.materials, depth]) material.needsUpdate = true;
    // in the pass for the depth, too, what is gone is not there
    for (const material of this.materials) material.allowOverride = false;
  }

  set({ opacity, taken, isInDisc, isCrossing, rank }: Share): void {
    const crosses = isInDisc && isCrossing;
    this.uniforms.uOpacity.value = opacity;
    this.uniforms.uTaken.value = taken;
    this.uniforms.uInDisc.value = isInDisc;
    this.uniforms.uCrosses.value = crosses;
    this.isBlended = opacity < 1 || taken > 0;
    this.isPane = this.isBlended && !crosses;
    this.isSolid = isInDisc && opacity === 1;
    this.scene.visible = opacity > 0 && (taken < 1 || isInDisc);
    this.depth.polygonOffsetUnits = rank * UNITS_APART + UNITS_BEHIND;
    for (const material of this.materials) {
      material.polygonOffsetUnits = rank * UNITS_APART;
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
