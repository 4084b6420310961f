/**
 * The surfaces of one channel, streamed by 3d-tiles-renderer.
 *
 * The tileset is in metres and z-up (3D Tiles 1.1). The renderer turns the glTF content, which is
 * y-up, into that space. The `group` turns it back and scales it to um, so its parent is the
 * stage's world.
 */
import { TilesRenderer } from "3d-tiles-renderer";
import type { Tile } from "3d-tiles-renderer/core";
import {
  Box3,
  type BufferGeometry,
  type Camera,
  Color,
  DoubleSide,
  Group,
  type Material,
  type Matrix4,
  Mesh,
  MeshStandardMaterial,
  type Object3D,
  Vector3,
} from "three";
import { BundleError } from "../bundle/errors";
import type { Channel } from "../bundle/generated/bundle";
import { TilesetFiles } from "../bundle/tileset_files";
import { cornersOf } from "../math/box";
import type { Rgb } from "../math/color";
import { extremePoints } from "../math/extreme_points";
import type { Vec3 } from "../math/vec3";
import { BlendedSurface, type SurfaceFrame } from "../render/blend_material";
import type { TileProgress } from "../state/overview_progress";
import { branchOf, leaveOut, putBack } from "./failed_branch";
import type { SurfaceLoader } from "./gltf_loader";
import { type Face, hideRemnants } from "./thin_remnants";
import type { Coarser, Levels } from "./triangle_budget";

const UM_PER_METRE = 1e6;
/** Depth of the tiles' coarsest LODs; the root above them has no content. */
const DEPTH_OF_COARSEST = 1;
/** Largest number of vertices of a mesh that are tested for its outermost points. */
const MAX_POINTS = 2000;
/** Share of a full cache that is kept after hidden surfaces are dropped. */
const KEPT_SHARE = 0.75;

export type Surface = Readonly<{
  scene: Object3D;
  tile: string;
  materials: readonly MeshStandardMaterial[];
  /** Linear colours of the glb. */
  colors: readonly Rgb[];
  /** Number of triangles drawn when the surface is on screen. */
  triangles: number;
  blend: BlendedSurface;
  /** Stops drawing the thin remnants at a face; null: draws all triangles. */
  hideRemnants: (face: Face | null) => void;
}>;

type PlacedMesh = Readonly<{ geometry: BufferGeometry; toWorld: Matrix4 }>;

export class SurfaceTileset {
  readonly group = new Group();
  readonly surfaces = new Map<Object3D, Surface>();
  private readonly tiles: TilesRenderer;
  private total: number | null = null;
  /** Coarsest tiles that are loaded or were abandoned. */
  private readonly done = new Set<Tile>();
  private readonly failed = new Set<Tile>();
  /** Outermost points of the loaded coarsest tiles, um, world. */
  private readonly outermost: Vec3[] = [];

  constructor(
    base: string,
    private readonly channel: Channel,
    loader: SurfaceLoader,
    private readonly frame: SurfaceFrame,
    bytes: number,
    private readonly onSurface: (surface: Surface) => void,
    private readonly onChange: () => void,
    onError: (error: unknown) => void,
  ) {
    if (channel.tileset === null) throw new Error(`channel ${channel.id} has no surface`);
    const files = new TilesetFiles(base, channel.tileset);
    this.tiles = new TilesRenderer(files.root);
    this.tiles.lruCache.maxBytesSize = bytes;
    this.tiles.lruCache.minBytesSize = KEPT_SHARE * bytes;
    this.tiles.maxDepth = DEPTH_OF_COARSEST + 1;
    this.tiles.manager.addHandler(/\.(gltf|glb)$/, loader.gltf);
    this.tiles.registerPlugin({
      name: "STEREOCELL_BUNDLE",
      fetchData: (url: string, { signal }: RequestInit) => files.fetch(url, signal),
      // called before the renderer adds its own `tile` to each userData
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
      else this.abandon(tile);
      onError(
        error instanceof BundleError
          ? error
          : new BundleError(
              `${files.nameOf(String(url))}: the surface can't be read: ${error.message}`,
              { cause: error },
            ),
      );
    });
    this.tiles.addEventListener("dispose-model", ({ scene }) => {
      this.surfaces.get(scene)?.blend.dispose();
      this.surfaces.delete(scene);
    });
    this.tiles.addEventListener("needs-update", this.onChange);
    this.tiles.addEventListener("tile-visibility-change", this.onChange);

    this.tiles.group.rotation.x = -Math.PI / 2;
    this.tiles.group.scale.setScalar(UM_PER_METRE);
    this.group.name = `surfaces of ${channel.id}`;
    this.group.add(this.tiles.group);
  }

  /**
   * Outermost points, um, world: corners of the box around everything until the coarsest tiles are
   * loaded; null if unknown.
   */
  get outline(): readonly Vec3[] | null {
    if (this.done.size === this.total) return this.outermost;
    const box = new Box3();
    if (!this.tiles.getBoundingBox(box)) return null;
    const { min, max } = box.applyMatrix4(this.matrix);
    return cornersOf({ min: min.toArray(), max: max.toArray() });
  }

  /** Matrix to um, world. */
  private get matrix(): Matrix4 {
    this.tiles.group.updateMatrix();
    return this.tiles.group.matrix;
  }

  get isShown(): boolean {
    return this.group.visible;
  }

  /**
   * Shows or hides the tileset. A hidden tileset releases its memory if another needs it; a shown
   * one tries failed tiles again.
   */
  show(isShown: boolean): void {
    if (isShown === this.group.visible) return;
    this.group.visible = isShown;
    if (isShown) {
      this.retryFailed();
      return;
    }
    const { lruCache } = this.tiles;
    const release = (tile: object) => {
      lruCache.markUnused(tile);
      return false;
    };
    this.tiles.traverse(release, null);
    lruCache.scheduleUnload();
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

  get drawn(): readonly Surface[] {
    return [...this.surfaces.values()].filter(
      ({ scene }) => scene.visible && this.tiles.group.children.includes(scene),
    );
  }

  get triangles(): number {
    return this.drawn.reduce((sum, { triangles }) => sum + triangles, 0);
  }

  /**
   * The levels of detail (LODs) of each tile that was in view in the last frame, as far as they are
   * known.
   */
  get inView(): readonly Levels[] {
    const { triangles } = this.channel;
    const coarsest = this.tiles.root?.children ?? [];
    return coarsest.flatMap((tile) => {
      // The traversal is undefined before the tile's first update.
      const { inFrustum = false, error = 0 } = tile.traversal ?? {};
      if (!inFrustum) return [];
      const px = error / tile.geometricError;
      const levels: { error_px: number; triangles: number }[] = [];
      for (let each: Tile | undefined = tile; each !== undefined; each = each.children?.[0]) {
        const all = triangles[triangles.length - 1 - levels.length] ?? 0;
        // The first operand keeps an error of 0 even at the eye, where px is infinite.
        const error_px = each.geometricError && px * each.geometricError;
        levels.push({ error_px, triangles: all / coarsest.length });
      }
      return [levels];
    });
  }

  /** Sets how far LODs are refined, by screen-space error: `errorTarget_px` pixels, or coarser. */
  refine(errorTarget_px: number, { factor, leftOut }: Coarser): void {
    const levels = Math.max(1, this.channel.triangles.length - leftOut);
    this.tiles.maxDepth = leftOut === 0 ? Number.POSITIVE_INFINITY : DEPTH_OF_COARSEST + levels;
    this.tiles.errorTarget = factor * errorTarget_px;
  }

  update(camera: Camera, width_px: number, height_px: number): void {
    for (const other of [...this.tiles.cameras]) {
      if (other !== camera) this.tiles.deleteCamera(other);
    }
    this.tiles.setCamera(camera);
    this.tiles.setResolution(camera, width_px, height_px);
    this.tiles.update();
  }

  /**
   * Removes a failed tile. The renderer would draw it as a hole in place of its parent; without the
   * failed child the parent stays. The coarsest tiles have no parent to show, and their finer LODs
   * may still load.
   */
  private abandon(tile: Tile): void {
    this.failed.add(tile);
    const branch = branchOf(tile);
    if (branch.internal.depth > DEPTH_OF_COARSEST) leaveOut(branch);
    this.count(tile);
  }

  /** Lets failed tiles be loaded again where they are needed. */
  retryFailed(): void {
    if (this.tiles.root === null) this.total = null;
    for (const tile of this.failed) {
      putBack(branchOf(tile));
      this.tiles.lruCache.remove(tile); // afterwards the renderer treats the tile as never loaded
    }
    this.failed.clear();
    this.tiles.resetFailedTiles(); // also resets the root
  }

  private count(tile: Tile): void {
    if (tile.internal.depth === DEPTH_OF_COARSEST) this.done.add(tile);
    this.onChange();
  }

  private adopt(scene: Object3D, tile: Tile): void {
    const materials = new Set<MeshStandardMaterial>();
    let id: string | null = null;
    scene.traverse((object) => {
      if (typeof object.userData.tile === "string") id = object.userData.tile;
      if (!(object instanceof Mesh)) return;
      for (const material of [object.material].flat() as Material[]) {
        if (material instanceof MeshStandardMaterial) materials.add(material);
      }
    });
    if (id === null) {
      throw new BundleError(`${tile.content?.uri}: extras.tile is missing, expected the tile's id`);
    }
    // Surfaces are open at the tile's border.
    for (const material of materials) material.side = DoubleSide;
    const list = [...materials];
    const meshes = placedMeshes(scene, this.matrix);
    let shownFace: Face | null = null;
    const surface = {
      scene,
      tile: id,
      materials: list,
      colors: list.map(({ color }) => [color.r, color.g, color.b] as const),
      get triangles() {
        return meshes.reduce((sum, { geometry }) => sum + drawnTriangles(geometry), 0);
      },
      blend: new BlendedSurface(scene, list, this.frame),
      hideRemnants: (face: Face | null) => {
        if (face === shownFace) return;
        shownFace = face;
        for (const { geometry, toWorld } of meshes) hideRemnants(geometry, toWorld, face);
      },
    };
    this.surfaces.set(scene, surface);
    if (tile.internal.depth === DEPTH_OF_COARSEST && !this.done.has(tile)) {
      this.outermost.push(...extremePoints(somePoints(meshes)));
    }
    this.onSurface(surface);
  }

  dispose(): void {
    this.tiles.dispose();
    this.group.removeFromParent();
    this.surfaces.clear();
  }
}

/** The meshes of a scene that has no parent yet, with their matrices. */
function placedMeshes(scene: Object3D, toWorld: Matrix4): readonly PlacedMesh[] {
  const found: PlacedMesh[] = [];
  scene.updateMatrixWorld(true);
  scene.traverse((object) => {
    if (!(object instanceof Mesh)) return;
    const { geometry, matrixWorld } = object;
    found.push({ geometry, toWorld: toWorld.clone().multiply(matrixWorld) });
  });
  return found;
}

function drawnTriangles({ index, attributes: { position }, drawRange }: BufferGeometry): number {
  return Math.min((index ?? position).count, drawRange.count) / 3;
}

/** A sample of the vertices, um, world. */
function somePoints(meshes: readonly PlacedMesh[]): readonly Vec3[] {
  return meshes.flatMap(({ geometry, toWorld }) => {
    const { position } = geometry.attributes;
    const step = Math.ceil(position.count / MAX_POINTS);
    return Array.from({ length: Math.ceil(position.count / step) }, (_, i) =>
      new Vector3()
        .fromBufferAttribute(position, i * step)
        .applyMatrix4(toWorld)
        .toArray(),
    );
  });
}

/** Sets a surface's colours, in linear RGB. */
export function paint(surface: Surface, colorOf: (glb: Rgb) => Rgb): void {
  surface.materials.forEach((material, i) => {
    material.color = new Color(...colorOf(surface.colors[i]));
  });
}
