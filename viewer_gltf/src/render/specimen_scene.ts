/** The scene: the specimen, its light, the background, and the outline of the selected tile. */
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
import type { Bounds, Manifest } from "../bundle/generated/bundle";
import type { FarLamp, SceneLight } from "../gpu/scene_light";
import type { Rgb } from "../math/color";
import type { Vec3 } from "../math/vec3";
import { sceneLightOf } from "../state/stage_light";
import type { Backdrop } from "./backdrop";
import { Specimen } from "./specimen_pose";
import { FAR, type Theme } from "./theme";

const OUTLINE = 0x5b6678;

export class SpecimenScene {
  readonly scene = new Scene();
  readonly specimen: Specimen;
  /** The light on everything that is not path-traced. */
  readonly light: SceneLight;
  private readonly key: DirectionalLight;
  private readonly fill: DirectionalLight;
  private readonly outline: Box3Helper;
  private readonly dark = new Color(FAR.dark);
  private readonly flat = new Color(FAR.dark);
  private isUsers = false;
  private backdrop: Backdrop | null = null;
  /** Outermost points of what is shown of the specimen, in metres of the scene. */
  private outermost: readonly Vec3[] = [];

  constructor(private readonly manifest: Manifest) {
    this.specimen = new Specimen(manifest.specimen.bounds_um);
    const { group } = this.specimen;
    this.scene.background = this.dark;
    this.light = sceneLightOf(manifest);
    const { key, fill, sky, ground } = this.light;
    this.key = new DirectionalLight(colorOf(key.light), Math.PI);
    this.fill = new DirectionalLight(colorOf(fill.light), Math.PI);
    this.scene.add(new HemisphereLight(colorOf(sky), colorOf(ground), Math.PI));
    this.scene.add(this.key, this.key.target, this.fill, this.fill.target, group);
    this.outline = new Box3Helper(new Box3(), OUTLINE);
    const material = this.outline.material as LineBasicMaterial;
    material.transparent = true;
    material.opacity = 0.6;
    this.outline.visible = false;
    group.add(this.outline);
  }

  /** Whether the user's own room is visible, so that nothing is drawn behind the specimen. */
  set isSeeThrough(is: boolean) {
    this.isUsers = is;
  }

  /** Whether the scene is seen on a flat screen by one eye. */
  set isFlat(is: boolean) {
    const isFlat = is && !this.isUsers;
    this.scene.background = this.isUsers ? null : isFlat ? this.flat : this.dark;
    if (this.backdrop !== null) this.backdrop.mesh.visible = isFlat;
  }

  /** @param backdrop null: the flat background has one colour */
  setTheme(theme: Theme, backdrop: Backdrop | null): void {
    this.flat.set(FAR[theme]);
    this.backdrop?.dispose();
    this.backdrop = backdrop;
    if (backdrop === null) return;
    backdrop.setTheme(theme);
    backdrop.fitTo(this.outermost);
    this.scene.add(backdrop.mesh);
  }

  /**
   * Fits the backdrop to the specimen.
   * @param points outermost points of what is shown of the specimen, in metres of the scene
   */
  fitBackdrop(points: readonly Vec3[]): void {
    this.outermost = points;
    this.backdrop?.fitTo(points);
  }

  /**
   * Axes in which the lamps' directions are given, in the scene. Lamps that stand with the eye move
   * with the user.
   *
   * @param head the user's pose in the scene
   */
  lampAxes(head: Matrix4): Matrix4 {
    return this.light.standsWith === "eye" ? head : this.specimen.group.matrixWorld;
  }

  /** @param head the user's pose in the scene */
  aimLamps(head: Matrix4): void {
    const axes = this.lampAxes(head);
    aim(this.key, axes, this.light.key);
    aim(this.fill, axes, this.light.fill);
  }

  /** Returns a tile's bounds (um, world), or null if there is no such tile. */
  boundsOf(tile: string | null): Bounds | null {
    return this.manifest.tiles.find(({ id }) => id === tile)?.bounds_um ?? null;
  }

  /** Outlines a tile if there are several; null: none. */
  mark(tile: string | null): void {
    const { tiles } = this.manifest;
    const found = tiles.length > 1 ? tiles.find(({ id }) => id === tile) : undefined;
    this.outline.visible = found !== undefined;
    if (found === undefined) return;
    this.outline.box.min.set(...found.bounds_um.min);
    this.outline.box.max.set(...found.bounds_um.max);
  }

  /** Objects that are not opaque, which the depth pass leaves out. */
  get overlays(): readonly Object3D[] {
    return this.backdrop === null ? [this.outline] : [this.outline, this.backdrop.mesh];
  }
}

/** A lamp's colour for three.js, whose white surface reflects a light's intensity divided by pi. */
function colorOf([r, g, b]: Rgb): Color {
  return new Color().setRGB(r, g, b);
}

/**
 * A directional light shines from its position to its target, which stays at the scene's origin.
 */
function aim(light: DirectionalLight, axes: Matrix4, { towards }: FarLamp): void {
  light.position.set(...towards).transformDirection(axes);
}
