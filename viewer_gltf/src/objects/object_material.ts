/**
 * The shader parts and textures that colour or hide each object of a label map. Colouring the objects by another
 * column uploads one byte for each object. Each surface is moved a little into its object. Otherwise the surfaces
 * of two neighbours would coincide at their interface, which shows where a cut opens them. A gap shrinks each
 * object as a whole: see gap.ts.
 */
import {
  BufferAttribute,
  type BufferGeometry,
  Color,
  DataTexture,
  Float32BufferAttribute,
  FloatType,
  type Matrix4,
  type Mesh,
  NearestFilter,
  RedFormat,
  RGBAFormat,
  SRGBColorSpace,
} from "three";
import { includeChunks } from "../gpu/glsl_include";
import type { Rgb } from "../math/color";
import type { SurfacePart } from "../render/blend_material";
import objectGap from "./chunks/object_gap.glsl?raw";
import objectLight from "./chunks/object_light.glsl?raw";
import objectStain from "./chunks/object_stain.glsl?raw";
import objectTexel from "./chunks/object_texel.glsl?raw";
import { middleOf } from "./gap";
import objectColor from "./part_chunks/fragment_color.glsl?raw";
import objectEnd from "./part_chunks/vertex_end.glsl?raw";
import objectPlace from "./part_chunks/vertex_place.glsl?raw";
import objectFragment from "./shaders/object_surface.frag.glsl?raw";
import objectVertex from "./shaders/object_surface.vert.glsl?raw";

/** Vertex attribute: the object's row in the table. It replaces the glb's feature ID, which counts within a tile. */
export const ROW = "object_row";
/** Vertex attribute: the direction out of the object, the same for all of its vertices at one position. */
const OUTWARDS = "object_outwards";
const FEATURE = "_feature_id_0";
/** Number of table rows in one line of a texture. */
const LINE = 256;
/** Factor between the metres of a glb and um. */
const UM_PER_METRE = 1e6;

const CHUNKS = {
  "chunks/object_gap": objectGap,
  "chunks/object_texel": objectTexel,
  "chunks/object_light": objectLight,
  "chunks/object_stain": objectStain,
};
const include = (source: string) => includeChunks(source, CHUNKS);

/**
 * Returns the direction out of its object for each vertex: three signed bytes, where 127 is 1. At a crease a glb has
 * one vertex for each side, each with that side's normal, and moving them along these would tear the surface open.
 * Therefore the normals at one position are averaged. The vertices of one object must follow one another.
 */
export function outwards({ attributes }: BufferGeometry, rows: Float32Array): Int8Array {
  const { position, normal } = attributes;
  const found = new Int8Array(3 * rows.length);
  let start = 0;
  for (let end = 1; end <= rows.length; end++) {
    if (end < rows.length && rows[end] === rows[start]) continue;
    const sums = new Map<string, [number, number, number]>();
    const at = (i: number) => `${position.getX(i)} ${position.getY(i)} ${position.getZ(i)}`;
    for (let i = start; i < end; i++) {
      const key = at(i);
      const sum = sums.get(key) ?? [0, 0, 0];
      sum[0] += normal.getX(i);
      sum[1] += normal.getY(i);
      sum[2] += normal.getZ(i);
      sums.set(key, sum);
    }
    for (let i = start; i < end; i++) {
      const sum = sums.get(at(i)) ?? [0, 0, 0];
      const length = Math.hypot(...sum) || 1;
      found.set(
        sum.map((v) => Math.round((127 * v) / length)),
        3 * i,
      );
    }
    start = end;
  }
  return found;
}

/** Number of texels of a texture with one texel for each table row, in full lines. */
const texelsOf = (count: number) => LINE * Math.max(1, Math.ceil(count / LINE));

function bytesTexture(count: number): DataTexture {
  const texels = new Uint8Array(texelsOf(count));
  const texture = new DataTexture(texels, LINE, texels.length / LINE, RedFormat);
  texture.minFilter = texture.magFilter = NearestFilter;
  texture.unpackAlignment = 1;
  return texture;
}

function middlesTexture(boxes: Float32Array): DataTexture {
  const count = boxes.length / 6;
  const texels = new Float32Array(4 * texelsOf(count));
  for (let row = 0; row < count; row++) texels.set(middleOf(boxes, row), 4 * row);
  const texture = new DataTexture(texels, LINE, texelsOf(count) / LINE, RGBAFormat, FloatType);
  texture.needsUpdate = true;
  return texture;
}

export class ObjectMaterial {
  private readonly flags: DataTexture;
  private readonly column: DataTexture;
  private readonly colors = new DataTexture(new Uint8Array(4 * LINE), LINE, 1, RGBAFormat);
  private readonly uniforms;
  private readonly middles: DataTexture;
  readonly part: SurfacePart;

  /**
   * @param boxes six values for each row, in um: the smallest x, y, z and the largest
   * @param inset_um distance by which each surface is moved into its object
   * @param umToScene matrix from um to the scene; the caller changes it in place
   */
  constructor(
    boxes: Float32Array,
    private readonly inset_um: number,
    umToScene: Matrix4,
  ) {
    const count = boxes.length / 6;
    this.flags = bytesTexture(count);
    this.column = bytesTexture(count);
    this.middles = middlesTexture(boxes);
    this.colors.colorSpace = SRGBColorSpace;
    this.uniforms = {
      uFlags: { value: this.flags },
      uColumn: { value: this.column },
      uColors: { value: this.colors },
      uIsColored: { value: false },
      uInset: { value: 0 },
      uMiddles: { value: this.middles },
      uUmToScene: { value: umToScene },
      uGap: { value: 0 },
      uStained: { value: 0 },
      uStain: { value: new Color(1, 1, 1) },
    };
    this.part = {
      key: "objects",
      uniforms: this.uniforms,
      chunks: {
        "part/vertex_declared": include(objectVertex),
        "part/vertex_place": objectPlace,
        "part/vertex_end": objectEnd,
        "part/fragment_declared": include(objectFragment),
        "part/fragment_color": objectColor,
      },
    };
  }

  /** Gives the vertices of a tile's mesh the rows of their objects. Returns whether the mesh has objects. */
  adopt({ geometry, matrixWorld: _, scale }: Mesh, rowOf: (feature: number) => number): boolean {
    const features = geometry.getAttribute(FEATURE);
    if (features === undefined) return false;
    const rows = new Float32Array(features.count);
    for (let i = 0; i < rows.length; i++) rows[i] = rowOf(features.getX(i));
    geometry.setAttribute(ROW, new Float32BufferAttribute(rows, 1));
    geometry.deleteAttribute(FEATURE);
    geometry.setAttribute(OUTWARDS, new BufferAttribute(outwards(geometry, rows), 3, true));
    // every glb file of a bundle has the same scale, so the inset in its units is equal for all
    // meshes
    this.uniforms.uInset.value = this.inset_um / (scale.x * UM_PER_METRE);
    return true;
  }

  setGap(gap_um: number): void {
    this.uniforms.uGap.value = gap_um;
  }

  /** @param color linear colour of the stain that is painted on the objects; null: none is painted */
  setStain(color: Rgb | null): void {
    this.uniforms.uStained.value = color === null ? 0 : 1;
    if (color !== null) this.uniforms.uStain.value.setRGB(...color);
  }

  setFlags(flags: Uint8Array): void {
    write(this.flags, flags);
  }

  /** @param bytes one for each row, of the column that colours; null: the objects keep the stage's colours */
  setColumn(bytes: Uint8Array | null): void {
    this.uniforms.uIsColored.value = bytes !== null;
    if (bytes !== null) write(this.column, bytes);
  }

  /** @param table 256 sRGB colours with alpha: see `tableOf` in palettes.ts */
  setColors(table: Uint8Array): void {
    write(this.colors, table);
  }

  dispose(): void {
    for (const each of [this.flags, this.column, this.colors, this.middles]) each.dispose();
  }
}

function write(texture: DataTexture, bytes: Uint8Array): void {
  (texture.image.data as Uint8Array).set(bytes);
  texture.needsUpdate = true;
}
