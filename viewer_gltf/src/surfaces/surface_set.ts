/** The surfaces of all shown channels: one tileset each, made when the channel is first shown. */
import { type Camera, Group, Matrix4, Mesh, ShaderMaterial, Vector3 } from "three";
import type { Bundle } from "../bundle/load";
import type { MemoryBudget } from "../gpu/memory_budget";
import { ERROR_TARGET_PX } from "../host/form";
import type { LoadedSurface, Surfaces } from "../host/services";
import { surfaceColor } from "../math/color";
import type { Vec3 } from "../math/vec3";
import type { BlendedScene, SurfaceFrame } from "../render/blend_material";
import type { ShownSurface } from "../state/on_screen";
import { overview, type Progress } from "../state/overview_progress";
import {
  type FocusTiles,
  hiddenShare,
  isInDisc,
  marchedTile,
  NO_FOCUS,
  wantsSurface,
} from "../state/representation";
import { Signal } from "../state/signal";
import type { ViewerState } from "../state/viewer_state";
import { turnsOf } from "./draw_order";
import type { SurfaceLoader } from "./gltf_loader";
import { paint, type Surface, SurfaceTileset } from "./surface_tileset";
import { type Face, faceTowards } from "./thin_remnants";
import { coarserFor, FINEST } from "./triangle_budget";

/** Presence of a volume, 0 to 1, from which on the thin remnants beside it are not drawn. */
const REMNANT_LIMIT = 0.5;

const CLOSED = { tile: null, faces: new Map<string, Face>() };

export type SurfaceOptions = Readonly<{
  loader: SurfaceLoader;
  frame: SurfaceFrame;
  /** Largest GPU memory and number of triangles for the surfaces of all channels together. */
  budget: Pick<MemoryBudget, "surfaces" | "triangles">;
  /** How far the volume of a tile and channel has faded in, 0 to 1. */
  presence: (tile: string, channel: string) => number;
  /** Whether all marched volumes show only inside the disc. */
  isCrossing: () => boolean;
  onChange: () => void;
  onError: (error: unknown) => void;
}>;

export class SurfaceSet implements Surfaces {
  /** The surfaces of all channels; coordinates are in um of the world. */
  readonly group = new Group();
  private readonly tilesets = new Map<string, SurfaceTileset>();
  private readonly toWorld = new Matrix4();
  private readonly eye = new Vector3();
  private state: ViewerState | null = null;
  private focusTiles: FocusTiles = NO_FOCUS;
  /**
   * The tile that is drawn as a volume, and the faces of its neighbours towards it, by neighbour.
   */
  private open: Readonly<{ tile: string | null; faces: ReadonlyMap<string, Face> }> = CLOSED;
  /** Whether the coarsest surfaces of all shown channels have been loaded at least once. */
  private hasBegun = false;
  private errorTarget_px = ERROR_TARGET_PX;
  /** How much coarser the surfaces are drawn, so that the device keeps its frame rate. */
  private coarser = FINEST;
  private readonly loaded = new Signal<Readonly<{ channel: string; surface: LoadedSurface }>>();

  constructor(
    private readonly bundle: Bundle,
    private readonly options: SurfaceOptions,
  ) {}

  get overview(): Progress {
    return overview(this.shown().map(([, tileset]) => tileset.progress));
  }

  /**
   * Whether all tiles of the first shown channel are on screen; also true if no channel is shown.
   */
  get hasFirst(): boolean {
    const [first] = this.shown();
    return first === undefined || overview([first[1].progress]).isComplete;
  }

  /**
   * Outermost points of a channel's surfaces, um, world; null if unknown. Until all coarsest
   * surfaces are loaded, they are the corners of the box around them.
   */
  outline(channel: string): readonly Vec3[] | null {
    return this.tilesets.get(channel)?.outline ?? null;
  }

  get isLoading(): boolean {
    return this.shown().some(([, tileset]) => tileset.isLoading);
  }

  get triangles(): number {
    return this.shown().reduce((sum, [, tileset]) => sum + tileset.triangles, 0);
  }

  retryFailed(): void {
    for (const [, tileset] of this.shown()) tileset.retryFailed();
  }

  setErrorTarget(pixels: number): void {
    this.errorTarget_px = pixels;
  }

  get blended(): readonly BlendedScene[] {
    return this.shown().flatMap(([, { surfaces }]) =>
      [...surfaces.values()].flatMap(({ scene, blend: { isBlended, isPane, isSolid } }) =>
        isBlended ? [{ scene, isPane, isSolid }] : [],
      ),
    );
  }

  of(channel: string): readonly Surface[] {
    return [...(this.tilesets.get(channel)?.surfaces.values() ?? [])];
  }

  /** The meshes on screen, without those that write only depth. */
  get meshes(): readonly ShownSurface[] {
    const found: ShownSurface[] = [];
    for (const [channel, { drawn }] of this.shown()) {
      for (const { scene, tile } of drawn) {
        scene.traverse((object) => {
          if (!(object instanceof Mesh) || object.material instanceof ShaderMaterial) return;
          found.push({ mesh: object, tile, channel });
        });
      }
    }
    return found;
  }

  onLoaded(listener: (channel: string, surface: LoadedSurface) => void): void {
    this.loaded.subscribe(({ channel, surface }) => listener(channel, surface));
  }

  /** Updates all surfaces after volumes appeared, disappeared or faded. */
  applyAllStyles(): void {
    for (const [id, { surfaces }] of this.shown()) {
      for (const surface of surfaces.values()) this.applyStyle(id, surface);
    }
  }

  sync(state: ViewerState, focusTiles: FocusTiles): void {
    this.state = state;
    this.focusTiles = focusTiles;
    this.openTile(marchedTile(state, focusTiles));
    for (const channel of state.channels) {
      const isWanted = wantsSurface(state, channel);
      if (isWanted && channel.hasSurface && !this.tilesets.has(channel.id)) this.add(channel.id);
      const tileset = this.tilesets.get(channel.id);
      if (tileset === undefined) continue;
      tileset.show(isWanted);
      for (const surface of tileset.surfaces.values()) this.applyStyle(channel.id, surface);
    }
  }

  update(camera: Camera, width_px: number, height_px: number): void {
    const isComplete = this.overview.isComplete;
    const inView = this.shown().flatMap(([, tileset]) => tileset.inView);
    this.coarser = coarserFor(
      inView,
      this.errorTarget_px,
      this.options.budget.triangles,
      this.coarser,
    );
    for (const [, tileset] of this.shown()) {
      if (isComplete) tileset.refine(this.errorTarget_px, this.coarser);
      tileset.update(camera, width_px, height_px);
      // one channel after another, so that the first one shows all tiles sooner
      if (!this.hasBegun && !overview([tileset.progress]).isComplete) break;
    }
    this.hasBegun ||= isComplete;
    this.order(camera);
  }

  private order(camera: Camera): void {
    const blended = this.shown().filter(([, { surfaces }]) =>
      [...surfaces.values()].some(({ blend }) => blend.isTranslucent),
    );
    if (blended.length === 0) return;
    const toWorld = this.toWorld.copy(this.group.matrixWorld).invert();
    const [x, y, z] = this.eye.setFromMatrixPosition(camera.matrixWorld).applyMatrix4(toWorld);
    const outlines = blended.map(([, { outline }]) => outline ?? []);
    const turns = turnsOf([x, y, z], outlines);
    for (const [i, [, { surfaces }]] of blended.entries()) {
      for (const { blend } of surfaces.values()) blend.setTurn(turns[i]);
    }
  }

  private shown(): [string, SurfaceTileset][] {
    return [...this.tilesets].filter(([, tileset]) => tileset.isShown);
  }

  private add(id: string): void {
    const channel = this.bundle.manifest.channels.find((c) => c.id === id);
    if (channel === undefined) throw new Error(`the bundle has no channel ${id}`);
    const { loader, frame, budget, onChange, onError } = this.options;
    const tileset = new SurfaceTileset(
      this.bundle.base,
      channel,
      loader,
      frame,
      budget.surfaces,
      (surface) => {
        this.applyStyle(id, surface);
        this.loaded.emit({ channel: id, surface });
      },
      onChange,
      onError,
    );
    this.tilesets.set(id, tileset);
    this.group.add(tileset.group);
  }

  /** Sets colour and visibility of one loaded surface from the state. */
  private applyStyle(id: string, surface: Surface): void {
    const { state } = this;
    const channel = state?.channels.find((c) => c.id === id);
    const tile = state?.tiles.find((each) => each.id === surface.tile);
    if (state === null || channel === undefined || tile === undefined) return;
    const presence = this.options.presence(tile.id, id);
    const taken = hiddenShare(state, channel, tile, this.focusTiles, presence);
    surface.blend.set({
      opacity: taken === null ? 0 : channel.opacity,
      taken: taken ?? 0,
      isInDisc: isInDisc(state, channel),
      isCrossing: this.options.isCrossing(),
      rank: state.channels.filter((each) => each.shown).indexOf(channel),
    });
    paint(surface, (glb) => surfaceColor(glb, channel.original, channel.color));
    const { open } = this;
    const isOpen = open.tile !== null && this.options.presence(open.tile, id) >= REMNANT_LIMIT;
    surface.hideRemnants((isOpen && open.faces.get(tile.id)) || null);
  }

  private openTile(id: string | null): void {
    if (id === this.open.tile) return;
    const { tiles } = this.bundle.manifest;
    const opened = tiles.find((tile) => tile.id === id);
    const faces = new Map<string, Face>();
    for (const tile of opened === undefined ? [] : tiles) {
      const face = opened && faceTowards(tile.bounds_um, opened.bounds_um);
      if (face) faces.set(tile.id, face);
    }
    this.open = { tile: id, faces };
  }

  dispose(): void {
    for (const tileset of this.tilesets.values()) tileset.dispose();
    this.tilesets.clear();
  }
}
