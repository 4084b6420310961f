/** The scene: the specimen in a dark room, its light, and the outline of the chosen tile. */
import {
  Box3,
  Box3Helper,
  Color,
  DirectionalLight,
  HemisphereLight,
  type LineBasicMaterial,
  type Matrix4,
  type Object3D,
  Scene,
} from "three";
import type { Manifest } from "../bundle/generated/bundle";
import { Specimen } from "./specimen_pose";

const BACKGROUND = 0x0b0d12;
const OUTLINE = 0x5b6678;

export class Room {
  readonly scene = new Scene();
  readonly specimen: Specimen;
  private readonly key = new DirectionalLight(0xfff4e6, 2.2);
  private readonly fill = new DirectionalLight(0xbfd4ff, 0.5);
  private readonly outline: Box3Helper;

  constructor(private readonly manifest: Manifest) {
    this.specimen = new Specimen(manifest.specimen.bounds_um);
    const { group } = this.specimen;
    this.scene.background = new Color(BACKGROUND);
    this.scene.add(new HemisphereLight(0xe8eefc, 0x2a2c33, 0.9));
    this.scene.add(this.key, this.key.target, this.fill, this.fill.target, group);
    this.outline = new Box3Helper(new Box3(), OUTLINE);
    const material = this.outline.material as LineBasicMaterial;
    material.transparent = true;
    material.opacity = 0.6;
    this.outline.visible = false;
    group.add(this.outline);
  }

  /** The lamp hangs over the viewer's left shoulder, wherever the viewer goes. */
  light(eye: Matrix4): void {
    aim(this.key, eye, -1.2, 1.6, 1.5);
    aim(this.fill, eye, 1.8, -0.4, 0.8);
  }

  /** Outline a tile, or none. */
  mark(tile: string | null): void {
    const found = this.manifest.tiles.find(({ id }) => id === tile);
    this.outline.visible = found !== undefined;
    if (found === undefined) return;
    this.outline.box.min.set(...found.bounds_um.min);
    this.outline.box.max.set(...found.bounds_um.max);
  }

  /** Everything but what is opaque, which the pass for the depth has to leave out. */
  get overlays(): readonly Object3D[] {
    return [this.outline];
  }
}

function aim(light: DirectionalLight, eye: Matrix4, x: number, y: number, z: number): void {
  light.position.set(x, y, z).applyMatrix4(eye);
  light.target.position.set(0, 0, -1).applyMatrix4(eye);
}
