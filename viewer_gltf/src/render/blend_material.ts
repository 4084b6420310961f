/**
 * Blends surfaces with the volumes that replace them, inside the focus disc or everywhere, and
 * draws translucent surfaces.
 *
 * A first pass writes depth without colour, so that only the front of a translucent surface shows.
 * Each translucent channel has a depth pass of its own. Channels are drawn from the farthest to the
 * nearest, so that they show through one another. Where a solid is cut open, or ends at a tile that
 * is shown as a volume, its inside is drawn as a flat section.
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
import { type Disc, type MarchedUniforms, VOLUME_DRAWN } from "../gpu/composite_pass";
import { CHUNKS } from "../gpu/glsl_chunks";
import { includeChunks } from "../gpu/glsl_include";
import { insertInto, insertionsOf } from "../gpu/insert_glsl";
import fragmentInsertions from "./insertions/surface.frag.glsl?raw";
import vertexInsertions from "./insertions/surface.vert.glsl?raw";
import surfaceFragment from "./shaders/surface.frag.glsl?raw";
import depthFragment from "./shaders/surface_depth.frag.glsl?raw";
import depthVertex from "./shaders/surface_depth.vert.glsl?raw";
import { defineNeeds, defineRough } from "./surface_needs";

/**
 * Uniforms that all surfaces share: the disc's cone and the clip planes in the scene, metres, and
 * the image of the volumes, which replaces surfaces in the disc.
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
  marched: MarchedUniforms,
  { uCuts, uCutCount, uOpen }: Pick<Cuts, "uCuts" | "uCutCount" | "uOpen">,
  both: BothEyes,
): SurfaceFrame {
  const shared = { uDisc, uApex, uAxis, uCuts, uCutCount, uOpen };
  return { uniforms: { ...shared, ...marched, ...both.uniforms }, both };
}

/**
 * A surface that is not opaque now.
 * `isPane`: the ray march needs its depth. `isSolid`: it is opaque outside the disc.
 */
export type BlendedScene = Readonly<{ scene: Object3D; isPane: boolean; isSolid: boolean }>;

/**
 * GLSL chunks by which a part of the viewer extends the surface shaders; see
 * insertions/surface.vert.glsl and surface.frag.glsl.
 */
type PartChunk =
  | `part/vertex_${"declared" | "place" | "end"}`
  | `part/fragment_${"declared" | "color"}`;

/** Shader code and uniforms that a part of the viewer adds to some surfaces. */
export type SurfacePart = Readonly<{
  /** Cache key of the shader text: equal texts have equal keys. */
  key: string;
  uniforms: Readonly<Record<string, { value: unknown }>>;
  chunks: Readonly<Record<PartChunk, string>>;
}>;

export type Share = Readonly<{
  opacity: number;
  /** Share of the surface that the channel's volume replaces, 0 to 1: in the disc, or everywhere. */
  taken: number;
  isInDisc: boolean;
  /** Whether surfaces and volumes are mixed across the disc's rim. */
  isCrossing: boolean;
  /**
   * Order among the shown channels: if two surfaces lie in one place, as at the end of the data,
   * the lower rank shows.
   */
  rank: number;
}>;

/**
 * Depth units between one channel and the next: more than the error of quantized coordinates; about
 * a millimetre for a specimen 1.2 m long.
 */
const UNITS_APART = 32;
/**
 * Triangles of a mesh from which on it is drawn for one eye after the other. Smaller meshes have too
 * few pixels for a draw call of their own.
 */
const LARGE_TRIANGLES = 20_000;
/** Depth units between a translucent surface's colour and its depth pass. */
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
 * Makes the material that writes depth only, clipped like the surfaces.
 *
 * @param uniforms include those of `both`
 * @param isShared whether nothing is written where a volume has replaced all of the surface
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

/** Step of the draw order by which a channel's depth pass precedes its colour. */
const DEPTH_AHEAD = 0.5;

/** Layer that holds only the depth passes of translucent surfaces; WebXR uses 1 and 2. */
export const PANES = 3;

/** Blending of premultiplied colours, and the stencil value that marks their pixels. */
const PREMULTIPLIED = {
  blendSrc: OneFactor,
  blendDst: OneMinusSrcAlphaFactor,
  stencilRef: VOLUME_DRAWN,
  stencilFunc: AlwaysStencilFunc,
  stencilZPass: ReplaceStencilOp,
} as const;

export class BlendedSurface {
  private readonly uniforms;
  private readonly both: BothEyes;
  private readonly depth: ShaderMaterial;
  private readonly meshes: readonly Mesh[];
  private readonly depthMeshes: readonly Mesh[];
  /**
   * Opacity that the stage gives the surface, 0 to 1; each surface of a bundle has one material.
   */
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
    this.both = both;
    this.uniforms = {
      ...uniforms,
      uOpacity: { value: 1 },
      uTaken: { value: 0 },
      uInDisc: { value: false },
      uCrosses: { value: false },
    };
    for (const material of materials) {
      this.patch(material);
      defineRough(material);
      both.adopt(material);
      defineNeeds(material, uniforms);
      material.forceSinglePass = true; // the depth pass already sorts front and back
      Object.assign(material, PREMULTIPLIED);
      // the loader turns depth off for translucent materials; here a depth pass precedes them
      material.transparent = false;
      material.depthWrite = true;
    }
    this.ownOpacity = materials[0]?.opacity ?? 1;
    this.depth = depthMaterial(this.uniforms, both, true);
    // The depth pass lies slightly behind the colour, beyond its rounding error. The offset does
    // not depend on the slope, because a slope-dependent offset would let things behind a rim
    // through.
    for (const material of [...materials, this.depth]) {
      material.polygonOffset = true;
      material.polygonOffsetFactor = 0;
    }
    const meshes: Mesh[] = [];
    scene.traverse((object) => {
      if (object instanceof Mesh) meshes.push(object);
    });
    this.meshes = meshes;
    // makes three.js sort the depth pass together with the surfaces' colours
    this.depth.transparent = true;
    this.depthMeshes = meshes.map((mesh) => {
      const depthMesh = new Mesh(mesh.geometry, this.depth);
      depthMesh.renderOrder = -DEPTH_AHEAD;
      depthMesh.visible = false;
      mesh.add(depthMesh);
      return depthMesh;
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

  setPart(part: SurfacePart): void {
    this.part = part;
    const { depth } = this;
    Object.assign(depth.uniforms, part.uniforms);
    depth.vertexShader = includeChunks(depthVertex, { ...CHUNKS, ...part.chunks });
    for (const material of [...this.materials, depth]) material.needsUpdate = true;
    // the pass that writes depth must not replace these materials, because they discard fragments
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
    if (!this.isTranslucent) this.setTurn(0);
    this.scene.visible = own > 0 && (taken < 1 || isInDisc);
    this.depth.polygonOffsetUnits = rank * UNITS_APART + UNITS_BEHIND;
    for (const material of this.materials) {
      material.polygonOffsetUnits = rank * UNITS_APART;
      material.stencilWrite = crosses && this.isBlended;
      if (material.transparent === this.isBlended) continue;
      material.transparent = this.isBlended;
      material.blending = this.isBlended ? CustomBlending : NormalBlending;
      material.needsUpdate = true; // the shader of an opaque surface leaves alpha out
    }
    // A blended surface has to be drawn after the surfaces and volumes behind it.
    for (const mesh of this.meshes) {
      const { index, attributes } = mesh.geometry;
      const isLarge = (index ?? attributes.position).count >= 3 * LARGE_TRIANGLES;
      this.both.drawForEach(mesh, isLarge && !this.isBlended);
    }
    for (const depthMesh of this.depthMeshes) {
      depthMesh.visible = this.isBlended;
      if (this.isPane) depthMesh.layers.enable(PANES);
      else depthMesh.layers.disable(PANES);
    }
  }

  /** Whether other translucent surfaces show through it, not only the volume that replaces it. */
  get isTranslucent(): boolean {
    return this.isBlended && this.uniforms.uOpacity.value * this.ownOpacity < 1;
  }

  /** Sets the place of a translucent surface in the draw order: the lowest turn is drawn first. */
  setTurn(turn: number): void {
    const order = this.isTranslucent ? 1 + turn : 0;
    for (const mesh of this.meshes) mesh.renderOrder = order;
    for (const depthMesh of this.depthMeshes) depthMesh.renderOrder = order - DEPTH_AHEAD;
  }

  dispose(): void {
    this.depth.dispose();
  }
}
