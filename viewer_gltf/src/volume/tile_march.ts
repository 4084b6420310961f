/** The ray-marched box of one tile: up to four channels in one pass. */
import {
  BackSide,
  BoxGeometry,
  Data3DTexture,
  DataTexture,
  type DepthTexture,
  GLSL3,
  LinearFilter,
  Matrix4,
  Mesh,
  NearestFilter,
  RedFormat,
  RGBAFormat,
  ShaderMaterial,
  UnsignedByteType,
  Vector3,
} from "three";
import type { TileVolume } from "../bundle/generated/volumes";
import type { Rgb } from "../color";
import { RAYMARCH_FRAGMENT, RAYMARCH_VERTEX } from "../shaders/raymarch";
import { MAX_VOLUME_CHANNELS } from "../state";
import type { TransferFunction } from "./luts";
import { brickDistances, markVisible } from "./occupancy";
import { distanceInGrid } from "./order";
import type { VolumeTexture } from "./volume_texture";

/** Hard limit of a ray, whatever the volume's size. */
export const MAX_STEPS = 100;
/** A ray that is this opaque goes no further. */
const OPAQUE = 0.98;
/** Steps are not shorter than this share of a voxel. */
const STEP_VOXELS = 0.7;

export type Part = Readonly<{
  channel: string;
  volume: Pick<VolumeTexture, "texture" | "level" | "bricks" | "brickCount">;
  transferFunction: TransferFunction;
  color: Rgb;
}>;

const UNIT_CUBE = new BoxGeometry(1, 1, 1);

/** Texture coordinates at the low and high corner of the box; image rows run against world y. */
export function textureCorners(volume: TileVolume): { low: Vector3; high: Vector3 } {
  const first = volume.size.map((n) => (volume.apron + 0.5) / n);
  const last = volume.size.map((n) => (n - volume.apron - 0.5) / n);
  return {
    low: new Vector3(first[0], last[1], first[2]),
    high: new Vector3(last[0], first[1], last[2]),
  };
}

export class TileMarch {
  readonly mesh: Mesh<BoxGeometry, ShaderMaterial>;
  private occupancy: Data3DTexture | null = null;
  private lut: DataTexture | null = null;
  private looks = "";
  private readonly toTile: Matrix4;

  constructor(
    private readonly volume: TileVolume,
    readonly channelCount: number,
    depth: DepthTexture,
  ) {
    const { min, max } = volume.bounds_um;
    const size = new Vector3(max[0] - min[0], max[1] - min[1], max[2] - min[2]);
    const center = new Vector3(...min).addScaledVector(size, 0.5);
    const { low, high } = textureCorners(volume);
    const intervals = volume.size.map((n) => n - 1 - 2 * volume.apron);
    const voxel = Math.min(...size.toArray().map((edge, i) => edge / Math.max(1, intervals[i])));
    const material = new ShaderMaterial({
      glslVersion: GLSL3,
      vertexShader: RAYMARCH_VERTEX,
      fragmentShader: RAYMARCH_FRAGMENT,
      defines: { CHANNELS: channelCount, MAX_STEPS, OPAQUE },
      side: BackSide,
      transparent: true,
      premultipliedAlpha: true,
      depthTest: false, // the march ends at the scene's depth itself
      depthWrite: false,
      uniforms: {
        uSize: { value: size },
        uTexLow: { value: low },
        uTexHigh: { value: high },
        uTexels: { value: new Vector3(...volume.size) },
        uVoxel: { value: voxel },
        uMinStep: { value: voxel },
        uBrickSlack: { value: 0 },
        uLight: { value: new Vector3(-0.35, 0.5, 0.8).normalize() },
        uColor: { value: Array.from({ length: channelCount }, () => new Vector3()) },
        uVolume0: { value: null },
        uVolume1: { value: null },
        uVolume2: { value: null },
        uVolume3: { value: null },
        uOccupancy: { value: null },
        uLut: { value: null },
        uSceneDepth: { value: depth },
      },
    });
    this.toTile = new Matrix4().fromArray(volume.matrix).invert();
    this.mesh = new Mesh(UNIT_CUBE, material);
    this.mesh.name = `volume of ${volume.tile}`;
    this.mesh.matrixAutoUpdate = false;
    this.mesh.matrix
      .fromArray(volume.matrix)
      .multiply(new Matrix4().makeTranslation(center))
      .multiply(new Matrix4().makeScale(size.x, size.y, size.z));
  }

  /** Blend in the right order with the other tiles. `eye` in um, world. */
  sortBy(eye: Vector3): void {
    const { min, max } = this.volume.bounds_um;
    const local = eye.clone().applyMatrix4(this.toTile).toArray();
    this.mesh.renderOrder = -distanceInGrid(local, min, max);
  }

  /** Follow colours, levels and transfer functions. Every part's texture has arrived. */
  update(parts: readonly Part[]): void {
    if (parts.length !== this.channelCount || parts.length > MAX_VOLUME_CHANNELS) {
      throw new RangeError(`expected ${this.channelCount} parts, found ${parts.length}`);
    }
    const { uniforms } = this.mesh.material;
    parts.forEach((part, i) => {
      uniforms[`uVolume${i}`].value = part.volume.texture;
      (uniforms.uColor.value as Vector3[])[i].set(...part.color);
    });
    const coarsest = Math.max(...parts.map((part) => part.volume.level));
    const finest = Math.min(...parts.map((part) => part.volume.level));
    uniforms.uBrickSlack.value = coarsest === 0 ? 0 : Math.ceil(2 ** coarsest / 8);
    uniforms.uMinStep.value = STEP_VOXELS * uniforms.uVoxel.value * 2 ** finest;
    this.updateLooks(parts);
  }

  /** Only a new choice of channels or transfer functions needs a new table of leaps. */
  private updateLooks(parts: readonly Part[]): void {
    const looks = parts.map((p) => `${p.channel}:${lookId(p.transferFunction)}`).join(" ");
    if (looks === this.looks) return;
    this.looks = looks;
    const { uniforms } = this.mesh.material;

    const rows = new Uint8Array(parts.length * 1024);
    parts.forEach((part, i) => {
      rows.set(part.transferFunction.entries, i * 1024);
    });
    this.lut?.dispose();
    this.lut = new DataTexture(rows, 256, parts.length, RGBAFormat, UnsignedByteType);
    this.lut.minFilter = this.lut.magFilter = LinearFilter;
    this.lut.needsUpdate = true;
    uniforms.uLut.value = this.lut;

    const count = parts[0].volume.brickCount;
    const visible = new Uint8Array(count[0] * count[1] * count[2]);
    for (const { volume, transferFunction } of parts) {
      if (volume.bricks === null) throw new Error("a texture came before its bricks");
      markVisible(visible, volume.bricks, transferFunction.ranges);
    }
    this.occupancy?.dispose();
    this.occupancy = new Data3DTexture(brickDistances(visible, count), ...count);
    this.occupancy.format = RedFormat;
    this.occupancy.type = UnsignedByteType;
    this.occupancy.minFilter = this.occupancy.magFilter = NearestFilter;
    this.occupancy.unpackAlignment = 1;
    this.occupancy.needsUpdate = true;
    uniforms.uOccupancy.value = this.occupancy;
  }

  dispose(): void {
    this.mesh.removeFromParent();
    this.mesh.material.dispose();
    this.lut?.dispose();
    this.occupancy?.dispose();
  }
}

const ids = new WeakMap<TransferFunction, number>();
let nextId = 0;

function lookId(look: TransferFunction): number {
  let id = ids.get(look);
  if (id === undefined) {
    id = nextId++;
    ids.set(look, id);
  }
  return id;
}
