/**
 * The surfaces of one channel, streamed by 3d-tiles-renderer.
 *
 * The tileset is in metres and z-up (3D Tiles 1.1); 3d-tiles-renderer turns the glTF content, which
 * is y-up, into that space. `group` turns it back and into um, so that its parent is the stage's
 * world.
 */
import { TilesRenderer } from "3d-tiles-renderer";
import type { Tile } from "3d-tiles-renderer/core";
import {
  type Camera,
  Color,
  DoubleSide,
  Group,
  type Material,
  Mesh,
  MeshStandardMaterial,
  type Object3D,
} from "three";
import { BundleError } from "../bundle/errors";
import { fileAddress, request } from "../bundle/fetch";
import type { Channel } from "../bundle/generated/bundle";
import type { Rgb } from "../color";
import type { SurfaceLoader } from "./loader";
import type { TileProgress } from "./progress";

const UM_PER_METRE = 1e6;
/** The root holds no content; below it lie the tiles' coarsest LODs. */
const DEPTH_OF_COARSEST = 1;

export type Surface = Readonly<{
  scene: Object3D;
  tile: string;
  materials: readonly MeshStandardMaterial[];
  /** Linear, as the glb has it. */
  colors: readonly Rgb[];
  triangles: number;
}>;

export class SurfaceTileset {
  readonly group = new Group();
  readonly surfaces = new Map<Object3D, Surface>();
  private readonly tiles: TilesRenderer;
  private total: number | null = null;
  /** Coarsest tiles that have been loaded or given up. */
  private readonly done = new Set<Tile>();

  constructor(
    base: string,
    channel: Channel,
    loader: SurfaceLoader,
    private readonly onSurface: (surface: Surface) => void,
    private readonly onChange: () => void,
    onError: (error: unknown) => void,
  ) {
    if (channel.tileset === null) throw new Error(`channel ${channel.id} has no surface`);
    const { path } = channel.tileset;
    this.tiles = new TilesRenderer(fileAddress(base, path));
    this.tiles.maxDepth = DEPTH_OF_COARSEST + 1;
    this.tiles.manager.addHandler(/\.(gltf|glb)$/, loader.gltf);
    const folder = new URL(".", base).href;
    this.tiles.registerPlugin({
      name: "STEREOCELL_BUNDLE",
      fetchData: (url: string, options: RequestInit) =>
        request(url, decodeURIComponent(url.replace(folder, "")), options),
      // Before the renderer puts its own `tile` into every userData.
      processTileModel: (scene: Object3D, tile: Tile) => this.adopt(scene, tile),
    });
    this.tiles.addEventListener("load-root-tileset", () => {
      const coarsest = this.tiles.root?.children ?? [];
      this.total = coarsest.filter((tile) => tile.content !== undefined).length;
      this.onChange();
    });
    this.tiles.addEventListener("load-model", ({ tile }) => this.count(tile));
    this.tiles.addEventListener("load-error", ({ tile, error, url }) => {
      if (tile === null) this.total = 0;
      else this.count(tile);
      const name = decodeURIComponent(String(url).replace(folder, ""));
      onError(
        error instanceof BundleError
          ? error
          : new BundleError(`${name}: ${error.message}`, { cause: error }),
      );
    });
    this.tiles.addEventListener("dispose-model", ({ scene }) => this.surfaces.delete(scene));
    this.tiles.addEventListener("needs-update", this.onChange);
    this.tiles.addEventListener("tile-visibility-change", this.onChange);

    this.tiles.group.rotation.x = -Math.PI / 2;
    this.tiles.group.scale.setScalar(UM_PER_METRE);
    this.group.name = `surfaces of ${channel.id}`;
    this.group.add(this.tiles.group);
  }

  get progress(): TileProgress {
    return { total: this.total, done: this.done.size };
  }

  get isLoading(): boolean {
    const { downloadQueue, parseQueue, processNodeQueue } = this.tiles;
    return (
      this.total === null || downloadQueue.running || parseQueue.running || processNodeQueue.running
    );
  }

  /** Triangles on screen. */
  get triangles(): number {
    let sum = 0;
    for (const { scene, triangles } of this.surfaces.values()) {
      if (scene.visible && this.tiles.group.children.includes(scene)) sum += triangles;
    }
    return sum;
  }

  /** Go on to finer LODs, by screen-space error: `errorTarget_px` pixels. */
  refine(errorTarget_px: number): void {
    this.tiles.maxDepth = Number.POSITIVE_INFINITY;
    this.tiles.errorTarget = errorTarget_px;
  }

  update(camera: Camera, width_px: number, height_px: number): void {
    for (const other of [...this.tiles.cameras]) {
      if (other !== camera) this.tiles.deleteCamera(other);
    }
    this.tiles.setCamera(camera);
    this.tiles.setResolution(camera, width_px, height_px);
    this.tiles.update();
  }

  private count(tile: Tile): void {
    if (tile.internal.depth === DEPTH_OF_COARSEST) this.done.add(tile);
    this.onChange();
  }

  private adopt(scene: Object3D, tile: Tile): void {
    const materials = new Set<MeshStandardMaterial>();
    let id: string | null = null;
    let triangles = 0;
    scene.traverse((object) => {
      if (typeof object.userData.tile === "string") id = object.userData.tile;
      if (!(object instanceof Mesh)) return;
      triangles += (object.geometry.index ?? object.geometry.attributes.position).count / 3;
      for (const material of [object.material].flat() as Material[]) {
        if (material instanceof MeshStandardMaterial) materials.add(material);
      }
    });
    if (id === null) {
      throw new BundleError(`${tile.content?.uri}: expected extras.tile with the tile's id`);
    }
    for (const material of materials) material.side = DoubleSide; // cut open at the tile's border
    const list = [...materials];
    const surface = {
      scene,
      tile: id,
      materials: list,
      colors: list.map(({ color }) => [color.r, color.g, color.b] as const),
      triangles,
    };
    this.surfaces.set(scene, surface);
    this.onSurface(surface);
  }

  dispose(): void {
    this.tiles.dispose();
    this.group.removeFromParent();
    this.surfaces.clear();
  }
}

/** Paint a surface; the colour is linear. */
export function paint(surface: Surface, colorOf: (glb: Rgb) => Rgb): void {
  surface.materials.forEach((material, i) => {
    material.color = new Color(...colorOf(surface.colors[i]));
  });
}
