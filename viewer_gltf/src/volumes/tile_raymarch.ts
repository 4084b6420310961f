/** The ray-marched box of one tile: up to four channels in one pass. */
import {
  AddEquation,
  BackSide,
  BoxGeometry,
  CustomBlending,
  Data3DTexture,
  DataArrayTexture,
  DataTexture,
  type DepthTexture,
  GLSL3,
  LinearFilter,
  Matrix4,
  MaxEquation,
  Mesh,
  NearestFilter,
  OneFactor,
  OneMinusSrcAlphaFactor,
  RedFormat,
  RepeatWrapping,
  RGBAFormat,
  ShaderMaterial,
  type Texture,
  UnsignedByteType,
  Vector2,
  Vector3,
  Vector4,
} from "three";
import { SKIP_BRICK, STREAM_BRICK } from "../bundle/generated/constants";
import type { TileVolume } from "../bundle/generated/volumes";
import { COLUMNS, ROWS } from "../bundle/transfer_2d";
import { blueNoise, NOISE_SIZE } from "../gpu/blue_noise";
import {
  boxAround,
  type ClipUniforms,
  clipInto,
  type MarchClip,
  noCorner,
} from "../gpu/clip_uniforms";
import { FILL, FILL_AT, GLOSS, GROUND, KEY, KEY_AT, SKY, towards } from "../gpu/room_light";
import type { Rgb } from "../math/color";
import { extremePoints } from "../math/extreme_points";
import type { Vec3 } from "../math/vec3";
import type { Compositing } from "../state/parameters/volumes";
import { distanceInGrid } from "./blend_order";
import { occupiedCorners } from "./occupied_bricks";
import { RAYMARCH_FRAGMENT, RAYMARCH_VERTEX } from "./shaders/sources";
import { brickCounts } from "./skip_bricks";
import { textureCorners } from "./texture_space";
import type { Packed } from "./tile_texture";
import { ENTRIES, edgeContrast, opacities } from "./transfer_luts";
import { alikeRows, type TransferTable2d, tablesInto, tableUniforms } from "./transfer_table_2d";

/** Most steps of a ray while anything moves, for any size of the volume and any number of tiles. */
export const MAX_STEPS = 100;
/** Most steps of a ray at rest: one a voxel through 512 of them. */
export const REST_STEPS = 512;
/** Opacity, 0..1, at which a ray ends. */
const OPAQUE = 0.99;
/** Shortest step, in voxels. */
const STEP_VOXELS = 1;

/** The light on all tiles: see gpu/chunks/shade.glsl. The directions are in the axes of the eye. */
export type MarchLight = ReturnType<typeof marchLight>;

/** Uniforms of a light that is still dark. */
export function marchLight() {
  return {
    uLight: { value: new Vector3() },
    uFill: { value: new Vector3() },
    uKeyLight: { value: new Vector3() },
    uFillLight: { value: new Vector3() },
    uSkyLight: { value: new Vector3() },
    uGroundLight: { value: new Vector3() },
    uGloss: { value: GLOSS },
  };
}

/** The room's own light, which surfaces have too. */
export function lightByRoom(light: MarchLight): void {
  light.uLight.value.set(...towards(KEY_AT)).normalize();
  light.uFill.value.set(...towards(FILL_AT)).normalize();
  light.uKeyLight.value.set(...KEY);
  light.uFillLight.value.set(...FILL);
  light.uSkyLight.value.set(...SKY);
  light.uGroundLight.value.set(...GROUND);
  light.uGloss.value = GLOSS;
}

/** Uniforms that all tiles share in a frame, by reference. */
export type MarchFrame = Readonly<{
  uSceneDepth: { value: DepthTexture };
  /** Of the nearest translucent surface, if there is any. */
  uPaneDepth: { value: DepthTexture };
  uHasPane: { value: boolean };
  uNoise: { value: Texture };
  /** By how much the noise is shifted in this frame, 0..1. */
  uPhase: { value: number };
  /** The eye's part of the picture, and of the march: x, y, width, height in pixels of each. */
  uEye: { value: Vector4 };
  uPart: { value: Vector4 };
  /** Tangents from the eye's axis by its clip space: factor, offset; 0: it looks through no lens. */
  uLens: { value: Vector4 };
  /** Cosines of the disc's inner and outer radius; below -1 the disc is everything. */
  uDisc: { value: Vector2 };
  /** Cosine of the radius within which the disc is marched. */
  uReach: { value: number };
  /** Whether all that is marched shows in the disc alone: then its picture is mixed with the surfaces'. */
  uIsCrossing: { value: boolean };
  uSteps: { value: number };
  /** Light that comes to each cell of a coarse grid, and by how much it counts, 0..1. */
  uReached: { value: Data3DTexture | null };
  uDepthShading: { value: number };
  /** Factor to the opacities' optical depth. */
  uDensity: { value: number };
}> &
  MarchLight;

/** Depth of what is opaque, and of the nearest that is translucent. */
export function makeFrame(depth: DepthTexture, pane = depth): MarchFrame {
  const noise = new DataTexture(blueNoise(), NOISE_SIZE, NOISE_SIZE, RedFormat, UnsignedByteType);
  noise.wrapS = noise.wrapT = RepeatWrapping;
  noise.minFilter = noise.magFilter = NearestFilter;
  noise.needsUpdate = true;
  const light = marchLight();
  lightByRoom(light);
  return {
    ...light,
    uSceneDepth: { value: depth },
    uPaneDepth: { value: pane },
    uHasPane: { value: false },
    uNoise: { value: noise },
    uPhase: { value: 0 },
    uEye: { value: new Vector4(0, 0, 1, 1) },
    uPart: { value: new Vector4(0, 0, 1, 1) },
    uLens: { value: new Vector4(0, 0, 0, 0) },
    uDisc: { value: new Vector2(-2, -3) },
    uReach: { value: -1 },
    uIsCrossing: { value: false },
    uSteps: { value: MAX_STEPS },
    uReached: { value: null },
    uDepthShading: { value: 0 },
    uDensity: { value: 1 },
  };
}

/** How one channel of a tile looks. */
export type Appearance = Readonly<{
  color: Rgb;
  /** 256 RGBA entries, of `lookUpTable`; beside a 2D table, what of it shows at any gradient. */
  table: Uint8Array;
  /** A two-dimensional transfer function. */
  table2d?: TransferTable2d | null;
  /** Part of the intensities, 0..1, that is shown from dark to bright; absent: all. */
  window?: readonly [number, number];
  isInDisc: boolean;
}>;

const ALL = [0, 1] as const;
const UNIT_CUBE = new BoxGeometry(1, 1, 1);

function skipTexture(skips: Uint8Array<ArrayBuffer>, size: readonly [number, number, number]) {
  const texture = new Data3DTexture(skips, ...size);
  texture.format = RedFormat;
  texture.type = UnsignedByteType;
  texture.minFilter = texture.magFilter = NearestFilter;
  texture.unpackAlignment = 1;
  texture.needsUpdate = true;
  return texture;
}

function emptyTables2d(channels: number): DataArrayTexture {
  const texture = new DataArrayTexture(
    new Uint8Array(channels * ROWS * COLUMNS * 4),
    COLUMNS,
    ROWS,
    channels,
  );
  texture.format = RGBAFormat;
  texture.type = UnsignedByteType;
  texture.minFilter = texture.magFilter = LinearFilter;
  return texture;
}

/** Blending of premultiplied light. */
const OVER = {
  blending: CustomBlending,
  blendEquation: AddEquation,
  blendSrc: OneFactor,
  blendDst: OneMinusSrcAlphaFactor,
};
const LARGEST = { ...OVER, blendEquation: MaxEquation, blendDst: OneFactor };
const ADDED = { ...OVER, blendDst: OneFactor };

export class TileMarch {
  readonly mesh: Mesh<BoxGeometry, ShaderMaterial>;
  /** All zero, nothing may be skipped, until the table has come. */
  private readonly skips: Uint8Array<ArrayBuffer>;
  private readonly occupancy: Data3DTexture;
  private readonly lut: DataTexture;
  /** The tables of value and gradient, a layer each channel; null: no channel has needed any. */
  private tables2d: DataArrayTexture | null = null;
  /** The content of each layer; null: a table that knows no gradients. */
  private readonly layers: (Uint8Array | null)[] = [];
  /** Goes up with each change of the tables. */
  looks = 0;
  /** Of each channel, whether it shows in the disc alone. */
  private inDisc: readonly boolean[] = [];
  private readonly low: Vector3;
  private readonly toTile: Matrix4;
  /** Between the world and the box from its low corner. */
  private readonly fromBox: Matrix4;
  readonly toBox: Matrix4;

  constructor(
    readonly volume: TileVolume,
    readonly channelCount: number,
    frame: MarchFrame,
  ) {
    const { min, max } = volume.bounds_um;
    this.low = new Vector3(...min);
    const size = new Vector3(...max).sub(this.low);
    const { low, high } = textureCorners(volume);
    const intervals = volume.size.map((n) => n - 1 - 2 * volume.apron);
    const voxel = Math.min(...size.toArray().map((edge, i) => edge / Math.max(1, intervals[i])));
    const rows = new Uint8Array(channelCount * ENTRIES * 4);
    this.lut = new DataTexture(rows, ENTRIES, channelCount, RGBAFormat, UnsignedByteType);
    this.lut.minFilter = this.lut.magFilter = LinearFilter;
    const bricks = brickCounts(volume.size);
    this.skips = new Uint8Array(bricks[0] * bricks[1] * bricks[2]);
    this.occupancy = skipTexture(this.skips, bricks);
    const material = new ShaderMaterial({
      glslVersion: GLSL3,
      vertexShader: RAYMARCH_VERTEX,
      fragmentShader: RAYMARCH_FRAGMENT,
      defines: { CHANNELS: channelCount, MAX_STEPS: REST_STEPS, OPAQUE, SKIP_BRICK },
      side: BackSide,
      transparent: true,
      ...OVER,
      depthTest: false, // the march ends at the scene's depth itself
      depthWrite: false,
      uniforms: {
        ...frame,
        uSize: { value: size },
        uTexLow: { value: low },
        uTexHigh: { value: high },
        uTexels: { value: new Vector3(...volume.size) },
        uVoxel: { value: voxel },
        uMinStep: { value: voxel },
        uFloor: { value: new Vector4(1, 1, 1, 1) },
        uContrast: { value: new Vector4(1, 1, 1, 1) },
        uWindowLow: { value: new Vector4() },
        uWindowHigh: { value: new Vector4(1, 1, 1, 1) },
        uBrickSlack: { value: 0 },
        uToShading: { value: new Matrix4() },
        uShadingCell: { value: 0 },
        uColor: { value: Array.from({ length: channelCount }, () => new Vector3()) },
        uInDisc: { value: [false, false, false, false] },
        uAllInDisc: { value: false },
        uApex: { value: new Vector3() },
        uAxis: { value: new Vector3(0, 0, -1) },
        uPresence: { value: 1 },
        uAllLow: { value: new Vector3() },
        uAllHigh: { value: size.clone() },
        uSpare: { value: 0 },
        uClipLow: { value: new Vector3() },
        uClipHigh: { value: size.clone() },
        uClipPlane: { value: new Vector4(0, 0, 0, 1) },
        uCorner: { value: noCorner() },
        uVolume: { value: null },
        uIndex: { value: null },
        uOldVolume: { value: null },
        uFresh: { value: 1 },
        uOccupancy: { value: this.occupancy },
        uLut: { value: this.lut },
        uTables2d: { value: null },
        ...tableUniforms(),
      },
    });
    const matrix = new Matrix4().fromArray(volume.matrix);
    this.toTile = matrix.clone().invert();
    this.fromBox = matrix.multiply(new Matrix4().makeTranslation(this.low));
    this.toBox = this.fromBox.clone().invert();
    this.mesh = new Mesh(UNIT_CUBE, material);
    this.mesh.name = `volume of ${volume.tile}`;
    this.mesh.frustumCulled = false;
    this.mesh.matrixAutoUpdate = false;
    this.mesh.matrix
      .fromArray(volume.matrix)
      .multiply(new Matrix4().makeTranslation(this.low.clone().addScaledVector(size, 0.5)))
      .multiply(new Matrix4().makeScale(size.x, size.y, size.z));
  }

  /** Blend in the right order with the other tiles. `eye` in um, world. */
  sortBy(eye: Vector3): void {
    const { min, max } = this.volume.bounds_um;
    const local = eye.clone().applyMatrix4(this.toTile).toArray();
    this.mesh.renderOrder = -distanceInGrid(local, min, max);
  }

  /** Where the disc's cone comes from and where to; um, world. */
  aim(apex: Vector3, axis: Vector3): void {
    const { uApex, uAxis } = this.mesh.material.uniforms;
    uApex.value.copy(apex).applyMatrix4(this.toBox);
    uAxis.value.copy(axis).transformDirection(this.toBox);
  }

  /** The box, um, world, round all tiles that are marched: they share a ray's steps by length. */
  shareWith(min: Vector3, max: Vector3, tiles: number): void {
    const { uniforms } = this.mesh.material;
    boxAround(min, max, this.toBox, uniforms.uAllLow.value, uniforms.uAllHigh.value);
    // each tile takes a step at least, however short the ray's way through it
    uniforms.uSpare.value = Math.min(tiles - 1, MAX_STEPS / 2);
  }

  /** The path that opacities hold for. */
  get voxel_um(): number {
    return this.mesh.material.uniforms.uVoxel.value;
  }

  /** The opacities of a channel's table, as it is drawn. */
  opacitiesOf(channel: number): Uint8Array {
    return opacities((this.lut.image.data as Uint8Array).subarray(channel * ENTRIES * 4));
  }

  /** Grow a box of the world, um, round this one. */
  growBox(min: Vector3, max: Vector3): void {
    const { x, y, z } = this.mesh.material.uniforms.uSize.value;
    const at = new Vector3();
    for (let i = 0; i < 8; i++) {
      at.set(i & 1 ? x : 0, i & 2 ? y : 0, i & 4 ? z : 0).applyMatrix4(this.fromBox);
      min.min(at);
      max.max(at);
    }
  }

  /** Outermost points, um, world, of what a channel shows; `ranges`: of its bricks. */
  outline(ranges: Uint8Array, channel: number): readonly Vec3[] {
    const { uSize, uTexLow, uTexHigh, uTexels } = this.mesh.material.uniforms;
    const size: Vector3 = uSize.value;
    const corners = occupiedCorners(
      ranges,
      this.opacitiesOf(channel),
      brickCounts(this.volume.size),
    );
    const across = uTexHigh.value.clone().sub(uTexLow.value);
    const points = corners.map((corner) => {
      const at = new Vector3(...corner).multiplyScalar(SKIP_BRICK).divide(uTexels.value);
      at.sub(uTexLow.value).divide(across).clampScalar(0, 1).multiply(size);
      return at.applyMatrix4(this.fromBox).toArray();
    });
    return extremePoints(points);
  }

  /** Where the grid of the shading lies: its low corner, um, world, cells, and a cell's edge, um. */
  placeShading(low: Vec3, size: readonly [number, number, number], edge_um: number): void {
    const { uToShading, uShadingCell } = this.mesh.material.uniforms;
    const [x, y, z] = size.map((n) => 1 / (n * edge_um));
    uToShading.value
      .makeScale(x, y, z)
      .multiply(new Matrix4().makeTranslation(-low[0], -low[1], -low[2]))
      .multiply(this.fromBox);
    uShadingCell.value = edge_um;
  }

  clip(clip: MarchClip): void {
    clipInto(clip, this.fromBox, this.toBox, this.mesh.material.uniforms as ClipUniforms);
  }

  /** Show what has come. `presence` 0..1: how far it has faded in. */
  show(shown: Packed, old: Packed | null, fresh: number, presence: number): void {
    if (shown.channels.length !== this.channelCount) {
      throw new RangeError(
        `expected ${this.channelCount} channels, found ${shown.channels.length}`,
      );
    }
    const { uniforms } = this.mesh.material;
    uniforms.uVolume.value = shown.texture;
    uniforms.uOldVolume.value = (old ?? shown).texture;
    uniforms.uIndex.value = shown.index;
    this.define("STREAM_BRICK", shown.index === null ? null : STREAM_BRICK);
    uniforms.uFresh.value = fresh;
    uniforms.uPresence.value = presence;
    const coarsest = Math.max(shown.level, old?.level ?? 0);
    // ranges of bricks hold for what is drawn, however coarse
    const isExact = coarsest === 0 || shown.index !== null;
    uniforms.uBrickSlack.value = isExact ? 0 : Math.ceil(2 ** coarsest / SKIP_BRICK);
    uniforms.uMinStep.value = STEP_VOXELS * uniforms.uVoxel.value * 2 ** shown.level;
  }

  /** Whether all of its channels show in the disc alone. */
  get isInDisc(): boolean {
    return this.inDisc.length > 0 && this.inDisc.every((is) => is);
  }

  /** Whether any of its channels does. */
  get isPartlyInDisc(): boolean {
    return this.inDisc.includes(true);
  }

  /** March what lies in the disc's cone alone, whatever the channels. */
  endAtDisc(ends: boolean): void {
    this.mesh.material.uniforms.uAllInDisc.value = ends || this.isInDisc;
  }

  /** Follow colours and tables: uploads a few kilobytes. True if what is visible may differ. */
  setAppearances(appearances: readonly Appearance[]): boolean {
    const { uniforms } = this.mesh.material;
    const rows = this.lut.image.data as Uint8Array;
    let differs = false;
    appearances.forEach(({ color, table, isInDisc, window: [low, high] = ALL }, c) => {
      (uniforms.uColor.value as Vector3[])[c].set(...color);
      uniforms.uInDisc.value[c] = isInDisc;
      uniforms.uFloor.value.setComponent(c, floorOf(table));
      uniforms.uContrast.value.setComponent(c, edgeContrast(table));
      uniforms.uWindowLow.value.setComponent(c, low);
      uniforms.uWindowHigh.value.setComponent(c, high);
      const row = rows.subarray(c * table.length, (c + 1) * table.length);
      if (table.every((value, i) => value === row[i])) return;
      row.set(table);
      differs = true;
    });
    if (differs) {
      this.lut.needsUpdate = true;
      this.looks++;
    }
    this.fillTables2d(appearances);
    this.inDisc = appearances.map(({ isInDisc }) => isInDisc);
    this.endAtDisc(false);
    this.define("DISC", this.isPartlyInDisc ? 1 : null);
    return differs;
  }

  /** If any channel has a table of value and gradient, all have: the others' rows are alike. */
  private fillTables2d(appearances: readonly Appearance[]): void {
    const isTwoD = appearances.some(({ table2d }) => table2d != null);
    this.define("TWO_D", isTwoD ? 1 : null);
    if (!isTwoD) return;
    const { uniforms } = this.mesh.material;
    this.tables2d ??= emptyTables2d(this.channelCount);
    uniforms.uTables2d.value = this.tables2d;
    const cells = this.tables2d.image.data as Uint8Array;
    const { length } = appearances[0].table;
    tablesInto(
      uniforms as ReturnType<typeof tableUniforms>,
      appearances.map(({ table2d }) => table2d),
    );
    appearances.forEach(({ table, table2d }, c) => {
      const at = c * ROWS * length;
      const isThere =
        table2d != null
          ? this.layers[c] === table2d.cells
          : this.layers[c] === null && table.every((value, i) => value === cells[at + i]);
      if (isThere) return;
      cells.set(table2d?.cells ?? alikeRows(table), at);
      this.layers[c] = table2d?.cells ?? null;
      if (this.tables2d === null) return;
      this.tables2d.addLayerUpdate(c); // the others stay as they are on the GPU
      this.tables2d.needsUpdate = true;
    });
  }

  /** What a ray makes of its samples, and how tiles are blended: as samples within one are. */
  composite(how: Compositing): void {
    const { material } = this.mesh;
    this.define("MAXIMUM", how === "maximum" ? 1 : null);
    this.define("SUM", how === "sum" ? 1 : null);
    Object.assign(material, how === "over" ? OVER : how === "maximum" ? LARGEST : ADDED);
  }

  /** Where rays may skip, one byte a brick, of `brickDistances`; null: nowhere, for now. */
  skipBy(distances: Uint8Array<ArrayBuffer> | null): void {
    if (distances === null) this.skips.fill(0);
    else this.skips.set(distances);
    this.occupancy.needsUpdate = true;
  }

  private define(name: string, value: number | null): void {
    const { material } = this.mesh;
    if ((material.defines[name] ?? null) === value) return;
    if (value === null) delete material.defines[name];
    else material.defines[name] = value;
    material.needsUpdate = true;
  }

  dispose(): void {
    this.mesh.removeFromParent();
    this.mesh.material.dispose();
    this.lut.dispose();
    this.tables2d?.dispose();
    this.occupancy.dispose();
  }
}

/** The intensity 0..1 up to which a table shows nothing; it is linear between its entries. */
export function floorOf(table: Uint8Array): number {
  for (let i = 0; i < ENTRIES; i++) if (table[4 * i + 3] > 0) return (i - 1) / (ENTRIES - 1);
  return 1;
}
