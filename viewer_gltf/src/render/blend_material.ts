/**
 * This file blends surfaces that give way to their volume, inside the disc or as a whole, and surfaces that are
 * made translucent. A first pass writes the depth without colour, so that only the front of a translucent surface
 * shows. Each translucent channel has a depth of its own. The channels are drawn from the farthest to the nearest, so
 * that they show through one another. Where a solid is cut open, or ends at the tile that is a volume, its inside
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
import type { BothEyes, BothEyesUniforms } from "../gpu/both_eyes";
import type { Cuts } from "../gpu/clip_planes";
import { type Disc, LAID, type MarchedUniforms } from "../gpu/composite_pass";
import { CHUNKS } from "../gpu/glsl_chunks";
import { includeChunks } from "../gpu/glsl_include";
import { insertInto, insertionsOf } from "../gpu/insert_glsl";
import fragmentInsertions from "./insertions/surface.frag.glsl?raw";
import vertexInsertions from "./insertions/surface.vert.glsl?raw";
import surfaceFragment from "./shaders/surface.frag.glsl?raw";
import depthFragment from "./shaders/surface_depth.frag.glsl?raw";
import depthVertex from "./shaders/surface_depth.vert.glsl?raw";

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

/** What the shaders of surfaces include of a part: see insertions/surface.vert.glsl and surface.frag.glsl. */
type PartChunk =
  | `part/vertex_${"declared" | "place" | "end"}`
  | `part/fragment_${"declared" | "color"}`;

/** What some surfaces have beside all others. */
export type SurfacePart = Readonly<{
  /** Of the text: the same for the same one. */
  key: string;
  uniforms: Readonly<Record<string, { value: unknown }>>;
  chunks: Readonly<Record<PartChunk, string>>;
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

const NO_PART: Pick<SurfacePart, "uniforms" | "chunks"> = {
  uniforms: {},
  chunks: {
    ...{ "part/vertex_declared": "", "part/vertex_place": "", "part/vertex_end": "" },
    ...{ "part/fragment_declared": "", "part/fragment_color": "" },
  },
};

const SURFACE = includeChunks(surfaceFragment, CHUNKS);
const DEPTH_FRAGMENT = includeChunks(depthFragment, CHUNKS);

/**
 * Writes depth alone, cut as the surfaces are.
 *
 * @param uniforms with those of `both`
 * @param isShared whether nothing is written where a volume has taken all of the surface
 */
export function depthMaterial(
  uniforms: Record<string, { value: unknown }>,
  both: BothEyes,
  isShared = false,
): ShaderMaterial {
  const material = new ShaderMaterial({
    glslVersion: GLSL3,
    colorWrite: false,
    side: DoubleSide,
    uniforms,
    defines: isShared ? { SHARED: 1 } : {},
    vertexShader: includeChunks(depthVertex, { ...CHUNKS, ...NO_PART.chunks }),
    fragmentShader: DEPTH_FRAGMENT,
  });
  both.adopt(material);
  return material;
}

/** This step of the render order lies between the depth of a channel's surfaces and their colour. */
const DEPTH_AHEAD = 0.5;

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
  private readonly meshes: readonly Mesh[];
  private readonly twins: readonly Mesh[];
  /** The opacity that the stage gives the surface, 0..1; each surface of a bundle has one material. */
  private readonly ownOpacity: number;
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
      // the loader leaves the depth of translucent materials out; here it is written first
      material.transparent = false;
      material.depthWrite = true;
    }
    this.ownOpacity = materials[0]?.opacity ?? 1;
    this.depth = depthMaterial(this.uniforms, both, true);
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
    this.meshes = meshes;
    this.depth.transparent = true; // in one order with the colours
    this.twins = meshes.map((mesh) => {
      const twin = new Mesh(mesh.geometry, this.depth);
      twin.renderOrder = -DEPTH_AHEAD;
      twin.visible = false;
      mesh.add(twin);
      return twin;
    });
  }

  private patch(material: MeshStandardMaterial): void {
    material.onBeforeCompile = (shader) => {
      const { chunks, uniforms } = this.part ?? NO_PART;
      Object.assign(shader.uniforms, this.uniforms, uniforms);
      const all = { ...CHUNKS, ...chunks, surface: SURFACE };
      const insertions = (file: string) => insertionsOf(includeChunks(file, all));
      shader.vertexShader = insertInto(shader.vertexShader, insertions(vertexInsertions));
      shader.fragmentShader = insertInto(shader.fragmentShader, insertions(fragmentInsertions));
    };
    material.customProgramCacheKey = () => `blended ${this.part?.key}`;
  }

  /** Have a part from now on. */
  wear(part: SurfacePart): void {
    this.part = part;
    const { depth } = this;
    Object.assign(depth.uniforms, part.uniforms);
    depth.vertexShader = includeChunks(depthVertex, { ...CHUNKS, ...part.chunks });
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
    const own = opacity * this.ownOpacity; // the shader multiplies both as well
    this.isBlended = own < 1 || taken > 0;
    this.isPane = this.isBlended && !crosses;
    this.isSolid = isInDisc && own === 1;
    if (!this.isTranslucent) this.take(0);
    this.scene.visible = own > 0 && (taken < 1 || isInDisc);
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

  /** Whether other translucent surfaces show through it, and not only a volume in its place. */
  get isTranslucent(): boolean {
    return this.isBlended && this.uniforms.uOpacity.value * this.ownOpacity < 1;
  }

  /** Place a translucent surface among all others: the lowest turn is drawn first. */
  take(turn: number): void {
    const order = this.isTranslucent ? 1 + turn : 0;
    for (const mesh of this.meshes) mesh.renderOrder = order;
    for (const twin of this.twins) twin.renderOrder = order - DEPTH_AHEAD;
  }

  dispose(): void {
    this.depth.dispose();
  }
}
