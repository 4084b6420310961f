/**
 * The volumes of one tile as bricks that are streamed by view. An atlas holds the bricks, and an
 * index gives the brick of each cell of STREAM_BRICK^3 texels (virtual texturing). The class has
 * the interface of `TileTexture`.
 */
import {
  ClampToEdgeWrapping,
  Data3DTexture,
  LinearFilter,
  NearestFilter,
  RedFormat,
  RGBAIntegerFormat,
  UnsignedByteType,
} from "three";
import { brickCounts } from "../skip_bricks";
import type { Packed } from "../tile_texture";
import type { VolumeSource } from "../volume_source";
import type { Brick, BrickLink, BrickReceiver } from "./client";
import { drawnNodes, NOTHING, rangesOf, STORED, STORED_BYTES, type Table } from "./tree";

/** Largest number of slots along an edge of an atlas: one byte holds a slot's coordinate. */
const MAX_SLOTS = 254;
/**
 * Milliseconds between updates with new bricks, since each update computes the empty-space tables
 * again.
 */
const SHOW_EVERY_MS = 250;
/**
 * Number that stands in the index in place of a resolution level if all voxels of a cell are equal.
 */
const UNIFORM = 255;

type Tree = {
  readonly receiver: BrickReceiver;
  table: Table | null;
  present: Uint8Array;
  readonly slots: Map<number, number>;
  waiting: Brick[];
};

export type Uploader = (atlas: Data3DTexture, slot: readonly number[], texels: Uint8Array) => void;

export class BrickTile {
  shown: Packed | null = null;
  readonly old = null;
  readonly fresh = 1;

  private sources: ReadonlyMap<string, VolumeSource> = new Map();
  private readonly trees = new Map<string, Tree>();
  private atlas: Data3DTexture | null = null;
  private index: Data3DTexture | null = null;
  private side: readonly [number, number, number] = [0, 0, 0];
  private used = 0;
  /**
   * Finest resolution level whose bricks, together with all coarser ones, fit in the atlas; 0 is
   * full resolution.
   */
  private finest = 0;
  private isStale = false;
  private shown_ms = 0;
  private isDisposed = false;

  constructor(
    private readonly tile: string,
    private readonly link: BrickLink,
    private readonly limits: Readonly<{ bytes: number; side: number }>,
    private readonly upload: Uploader,
    private readonly onChange: () => void,
    /** Called if the tile is not available as bricks. */
    private readonly onRefused: () => void,
  ) {}

  get isLoading(): boolean {
    const isComing = this.shown === null && this.trees.size > 0 && !this.link.isAway;
    return this.link.isBusy || this.isStale || isComing;
  }

  /** Whether all bricks that the view needs are loaded and shown. */
  get isComplete(): boolean {
    return this.shown !== null && !this.isLoading && !this.link.isAway;
  }

  get bytes(): number {
    const [x, y, z] = this.side;
    return x * y * z * STORED_BYTES;
  }

  get kept(): ReadonlyMap<string, VolumeSource> {
    return this.sources;
  }

  hasFailed(): boolean {
    return false; // a host refuses a whole tile, and never a single channel
  }

  retryFailed(): void {}

  /**
   * For each channel, an intensity, 0 to 255, or -1. The host leaves out bricks whose voxels are
   * all at or below it. A transfer function that shows such voxels therefore needs other bricks.
   */
  get thresholds(): readonly number[] {
    return [...this.trees.values()].map(({ table }) => table?.threshold ?? -1);
  }

  /** Starts to stream the bricks of these volumes, as the camera's view needs them. */
  want(
    sources: ReadonlyMap<string, VolumeSource>,
    _levels?: readonly number[],
    _finest?: number,
  ): void {
    this.sources = sources;
    const isSame =
      this.trees.size === sources.size && [...sources.keys()].every((id) => this.trees.has(id));
    if (isSame) return;
    this.closeAll();
    for (const [id, { volume }] of sources) {
      const receiver: BrickReceiver = {
        onTable: (table) => this.begin(id, receiver, table),
        onBricks: (bricks) => this.take(id, receiver, bricks),
        // bricks that are loaded stay when the connection is lost
        onRefused: () => {
          if (this.shown === null) this.onRefused();
        },
      };
      const tree: Tree = { receiver, table: null, present: NONE, slots: new Map(), waiting: [] };
      this.trees.set(id, tree);
      this.link.open(this.tile, id, volume.file.sha256, receiver);
    }
  }

  /** Shows newly loaded bricks from time to time. Returns whether more bricks wait to be shown. */
  advance(_dt_s: number, now_ms = performance.now()): boolean {
    if (!this.isStale) return false;
    if (now_ms - this.shown_ms < SHOW_EVERY_MS) return true;
    this.shown_ms = now_ms;
    this.isStale = false;
    this.pack();
    return false;
  }

  private treeOf(id: string, receiver: BrickReceiver): Tree | null {
    const tree = this.trees.get(id);
    return tree?.receiver === receiver ? tree : null;
  }

  private begin(id: string, receiver: BrickReceiver, table: Table): void {
    const tree = this.treeOf(id, receiver);
    if (tree === null) return;
    if (tree.table !== null) {
      // A table that arrives after a reconnection changes nothing if it is of the same volume. If
      // it is of another volume, the loaded bricks are useless.
      if (tree.table.nodes[0]?.hash !== table.nodes[0]?.hash) this.onRefused();
      return;
    }
    tree.table = table;
    tree.present = new Uint8Array(table.nodes.length);
    const tables = [...this.trees.values()].map((each) => each.table);
    if (tables.includes(null)) return;
    this.makeAtlas(tables.flatMap((each) => each ?? []));
    for (const each of this.trees.values()) this.place(each, each.waiting.splice(0));
    this.isStale = true;
    this.onChange();
  }

  private makeAtlas(tables: readonly Table[]): void {
    const most = Math.floor(this.limits.bytes / STORED_BYTES);
    const longest = Math.min(MAX_SLOTS, Math.floor(this.limits.side / STORED));
    const countFrom = (level: number) =>
      tables.reduce(
        (sum, { nodes }) => sum + nodes.filter((n) => !n.isEmpty && n.level >= level).length,
        0,
      );
    this.finest = 0;
    while (countFrom(this.finest) > Math.min(most, longest ** 3)) this.finest++;
    const count = Math.max(1, countFrom(this.finest));
    const x = Math.min(longest, Math.ceil(Math.cbrt(count)));
    const y = Math.min(longest, Math.ceil(Math.sqrt(count / x)));
    this.side = [x, y, Math.ceil(count / (x * y))];
    const [w, h, d] = this.side.map((n) => n * STORED);
    this.atlas = new Data3DTexture(null, w, h, d);
    this.atlas.format = RedFormat;
    this.atlas.type = UnsignedByteType;
    this.atlas.minFilter = this.atlas.magFilter = LinearFilter;
    this.atlas.wrapS = this.atlas.wrapT = this.atlas.wrapR = ClampToEdgeWrapping;
    this.atlas.unpackAlignment = 1;
    this.atlas.source.dataReady = false; // bricks are copied into it one by one
    this.atlas.needsUpdate = true;
    const [cx, cy, cz] = tables[0].cells;
    const cells = new Uint8Array(4 * cx * cy * cz * tables.length);
    this.index = new Data3DTexture(cells, cx, cy, cz * tables.length);
    this.index.format = RGBAIntegerFormat;
    this.index.internalFormat = "RGBA8UI";
    this.index.type = UnsignedByteType;
    this.index.minFilter = this.index.magFilter = NearestFilter;
    this.index.unpackAlignment = 4;
  }

  private take(id: string, receiver: BrickReceiver, bricks: readonly Brick[]): void {
    const tree = this.treeOf(id, receiver);
    if (tree === null) return;
    if (this.atlas === null) tree.waiting.push(...bricks);
    else this.place(tree, bricks);
    this.isStale = true;
    this.onChange();
  }

  private place(tree: Tree, bricks: readonly Brick[]): void {
    if (this.atlas === null || tree.table === null) return;
    for (const { node, texels } of bricks) {
      const known = tree.table.nodes[node];
      if (known === undefined || known.level < this.finest || tree.slots.has(node)) continue;
      const slot = this.used++;
      tree.slots.set(node, slot);
      tree.present[node] = 1;
      const at = this.slotAt(slot).map((v) => v * STORED);
      this.upload(this.atlas, at, texels);
    }
  }

  private slotAt(slot: number): readonly [number, number, number] {
    const [x, y] = this.side;
    return [slot % x, Math.floor(slot / x) % y, Math.floor(slot / (x * y))];
  }

  /** Builds the index and the ranges of the drawn bricks. */
  private pack(): void {
    const { atlas, index } = this;
    if (atlas === null || index === null) return;
    const cells = index.image.data as Uint8Array;
    const ids = [...this.trees.keys()];
    const bricks: Uint8Array[] = [];
    let isWhole = true;
    let level = Number.POSITIVE_INFINITY;
    let to = 0;
    for (const { table, present, slots } of this.trees.values()) {
      if (table === null) return;
      const drawn = drawnNodes(table, present);
      for (const node of drawn) {
        if (node === NOTHING) {
          isWhole = false;
          cells.set([0, 0, 0, UNIFORM], to);
        } else if (table.nodes[node].isEmpty) {
          cells.set([table.nodes[node].constant, 0, 0, UNIFORM], to);
        } else {
          cells.set(this.slotAt(slots.get(node) ?? 0), to);
          cells[to + 3] = table.nodes[node].level;
          level = Math.min(level, table.nodes[node].level);
        }
        to += 4;
      }
      bricks.push(rangesOf(table, drawn, brickCounts(table.size)));
    }
    // until the coarsest brick of each channel has arrived, the last content stays on screen
    if (!isWhole) return;
    index.needsUpdate = true;
    const finest = Number.isFinite(level) ? level : 0;
    this.shown = { channels: ids, level: finest, texture: atlas, bricks, cells: null, index };
    this.onChange();
  }

  private closeAll(): void {
    for (const [id, { receiver }] of this.trees) this.link.close(this.tile, id, receiver);
    this.trees.clear();
    this.atlas?.dispose();
    this.index?.dispose();
    this.atlas = this.index = null;
    this.side = [0, 0, 0];
    this.used = 0;
    this.isStale = false;
    this.shown = null;
  }

  dispose(): void {
    if (this.isDisposed) return;
    this.isDisposed = true;
    this.closeAll();
  }
}

const NONE = new Uint8Array(0);
