/** The objects of one label map: their table, the colours and visibility of their surfaces, and picking by a ray. */
import { Matrix4, Mesh, type Object3D } from "three";
import type { FileRef, Manifest } from "../bundle/generated/bundle";
import type { ColorLegend, Surfaces } from "../host/services";
import { type Box, centerOf } from "../math/box";
import type { Clip } from "../math/clip";
import type { Rgb } from "../math/color";
import type { Ray, Vec3 } from "../math/vec3";
import { type ObjectChange, type ObjectView, START_OBJECTS } from "../state/objects";
import type { ChannelState, ViewerState } from "../state/viewer_state";
import { objectsCsv } from "./csv";
import { filtered, flag, GONE } from "./flags";
import { middleOf } from "./gap";
import { colorLegend } from "./legend";
import { readLinked, writeLinked } from "./linked";
import { ObjectMaterial } from "./object_material";
import { tableOf } from "./palettes";
import { type ObjectHit, pickObject } from "./pick";
import { stageColors } from "./stage_colors";
import { loadObjects, type ObjectTable } from "./table";

/** Distance by which each surface is moved into its object, as a share of the specimen's longest edge. */
const INSET = 4e-4;

export type ObjectsOptions = Readonly<{
  base: string;
  manifest: Manifest;
  channel: string;
  file: FileRef;
  /** The drawn surfaces; null: the viewer has no part that draws surfaces. */
  surfaces: Surfaces | null;
  /** The scene object that contains the specimen; its matrix maps um to metres of the scene. */
  specimen: Object3D;
  dispatch: (change: ObjectChange, isStep?: boolean) => void;
  /** Flies to the box of an object, in um. `isSeen` returns whether no other object hides it from an eye. */
  onAim: (box: Box, isSeen: (eye: Vec3) => boolean) => void;
  onChange: () => void;
  onError: (error: unknown) => void;
}>;

export class Objects {
  readonly flags: Uint8Array;
  /** Number of shown objects. */
  shownCount = 0;
  private readonly material: ObjectMaterial;
  private view: ObjectView = START_OBJECTS;
  /** The channel whose intensity is painted on the objects. */
  private painter: Pick<ChannelState, "name" | "color"> | null = null;
  private clip: Clip = { box: null, plane: null };
  private isShown = false;
  private aimed: ObjectView["aim"] = null;
  /** Keys of the column, colours and flags that the textures contain now. */
  private drawn: Readonly<Record<"column" | "colors" | "flags", string>> = {
    column: "",
    colors: "",
    flags: "",
  };
  private stageColors: readonly string[] = [];
  private readonly adopted = new WeakSet<Object3D>();
  private isWaiting = false;

  private constructor(
    readonly table: ObjectTable,
    private readonly options: ObjectsOptions,
  ) {
    const { min, max } = options.manifest.specimen.bounds_um;
    const edge_um = Math.max(...max.map((v, i) => v - min[i]));
    const umToScene = options.specimen.matrixWorld;
    this.material = new ObjectMaterial(table.boxes, INSET * edge_um, umToScene);
    this.flags = new Uint8Array(table.count);
    this.adoptAll();
  }

  /** Loads the table of a label map. Throws BundleError. */
  static async load(options: ObjectsOptions): Promise<Objects> {
    let made: Objects | null = null;
    const onChange = () => {
      made?.draw();
      options.onChange();
    };
    const { base, file, onError } = options;
    made = new Objects(await loadObjects(base, file, onChange, onError), options);
    return made;
  }

  get isLoading(): boolean {
    return this.table.isLoading;
  }

  /** ID of the column that colours the objects; "": no column does. */
  get colorBy(): string {
    return this.view.colorBy ?? this.table.first;
  }

  /** A text that changes whenever other objects are shown or lit. */
  get version(): string {
    return `${this.drawn.flags} ${this.shownCount}`;
  }

  /** Name of the channel that is painted on the objects; "": none is. */
  get stainName(): string {
    return this.painter?.name ?? this.table.painter;
  }

  private get stain(): Rgb {
    return this.painter?.color ?? [1, 1, 1];
  }

  /** Widest gap that the slider offers, um: half of the median of the objects' shortest box edges. */
  get widestGap_um(): number {
    const { boxes, count } = this.table;
    const widths = Array.from({ length: Math.min(count, 1000) }, (_, i) => {
      const row = Math.floor((i * count) / Math.min(count, 1000));
      return middleOf(boxes, row)[3];
    }).sort((one, other) => one - other);
    return Math.max(0.5 * (widths[widths.length >> 1] ?? 1), 1e-3);
  }

  /** Rows of the shown objects. */
  get shown(): readonly number[] {
    const rows: number[] = [];
    for (let row = 0; row < this.flags.length; row++) if (this.flags[row] !== GONE) rows.push(row);
    return rows;
  }

  sync(state: ViewerState): void {
    const { channel, dispatch } = this.options;
    this.clip = state.clip;
    this.isShown = state.channels.some(({ id, shown }) => id === channel && shown);
    this.view = state.objects[channel] ?? START_OBJECTS;
    this.painter = state.channels.find(({ id }) => id === this.table.painter) ?? null;
    if (this.view.linked !== "") {
      dispatch(
        { type: "objects", channel, change: readLinked(this.view.linked, this.table) },
        false,
      );
      return; // the dispatched change has called this method again
    }
    this.draw();
    const { aim } = this.view;
    if (aim !== this.aimed && aim !== null) {
      const box = this.box(aim.row);
      this.options.onAim(box, (eye) => this.isSeen(aim.row, centerOf(box), eye));
    }
    this.aimed = aim;
  }

  /** Adopts the surfaces that have loaded already. The part calls `adopt` for each one that loads later. */
  private adoptAll(): void {
    for (const { scene, tile, blend } of this.options.surfaces?.of(this.options.channel) ?? []) {
      this.adopt(scene, tile, blend);
    }
  }

  /** Gives the meshes of a tile the rows of their objects, and the material that colours them. */
  adopt(
    scene: Object3D,
    tile: string,
    blend: Readonly<{ setPart: (part: ObjectMaterial["part"]) => void }>,
  ): void {
    if (this.adopted.has(scene)) return;
    this.adopted.add(scene);
    const rowOf = this.table.rowOf(tile);
    const done = new Set<unknown>();
    let hasObjects = false;
    scene.traverse((object) => {
      if (!(object instanceof Mesh) || done.has(object.geometry)) return;
      done.add(object.geometry); // the mesh that only writes depth shares this geometry
      if (this.stageColors.length === 0) this.stageColors = stageColors(object.geometry);
      hasObjects = this.material.adopt(object, rowOf) || hasObjects;
    });
    if (hasObjects) blend.setPart(this.material.part);
  }

  /** Updates the textures to the view. Columns that are still loading are drawn once they have loaded. */
  private draw(): void {
    const { table, view, material } = this;
    const column = table.column(this.colorBy);
    const bytes = column && table.bytes(column.id);
    const next = {
      column: bytes === null ? "" : this.colorBy,
      colors: `${this.colorBy} ${view.palette} ${view.span} ${view.isLog}`,
      flags: JSON.stringify([
        ...[view.ranges, view.without, view.hidden, view.only, view.selected, view.picked],
        filtered(view).map((id) => table.bytes(id) !== null),
      ]),
    };
    if (
      this.isFirst ||
      (next.column !== this.drawn.column && (bytes !== null || column === null))
    ) {
      material.setColumn(bytes);
      this.drawn = { ...this.drawn, column: next.column };
    }
    if (next.colors !== this.drawn.colors && column !== null && bytes !== null) {
      material.setColors(tableOf(column, view));
      this.drawn = { ...this.drawn, colors: next.colors };
    }
    if (this.isFirst || next.flags !== this.drawn.flags) {
      const neighbours = view.picked === null ? [] : table.neighbours(view.picked);
      this.shownCount = flag(this.flags, view, (id) => table.bytes(id), neighbours);
      material.setFlags(this.flags);
      this.drawn = { ...this.drawn, flags: next.flags };
    }
    material.setStain(this.table.painter !== "" && view.isStained ? this.stain : null);
    material.setGap(view.gap_um);
    this.isFirst = false;
    this.isWaiting = column !== null && bytes === null;
  }

  private isFirst = true;

  /** Returns the nearest shown object along a ray in um; null: the ray hits none. */
  hit(ray: Ray): ObjectHit | null {
    if (!this.isShown || this.isWaiting) return null;
    const { surfaces, specimen, channel } = this.options;
    const meshes = (surfaces?.meshes ?? []).filter((each) => each.channel === channel);
    const world = new Matrix4().copy(specimen.matrixWorld);
    const { boxes } = this.table;
    return pickObject(ray, world, meshes, boxes, this.view.gap_um, this.flags, this.clip);
  }

  /**
   * Returns whether no other object hides the object of a row from an eye. An eye that sees no object at all also
   * counts: meshes outside the view may not be on screen, and only meshes on screen can be tested.
   */
  private isSeen(row: number, middle: Vec3, eye: Vec3): boolean {
    const [x, y, z] = middle.map((v, i) => v - eye[i]);
    const found = this.hit({ origin: eye, direction: [x, y, z] });
    return found === null || found.row === row;
  }

  /**
   * Opens the card of a row, or closes it if it is open. A resting gaze never closes a card, and a card that it
   * opens is not a step that can be undone.
   */
  pick(row: number, isByGaze: boolean): void {
    const { channel, dispatch } = this.options;
    if (isByGaze && this.view.picked === row) return;
    const picked = this.view.picked === row ? null : row;
    dispatch({ type: "objects", channel, change: { picked } }, !isByGaze);
  }

  box(row: number): Box {
    const [x, y, z, ...high] = this.table.boxes.subarray(6 * row, 6 * row + 6);
    return { min: [x, y, z], max: [high[0], high[1], high[2]] };
  }

  /** CSV of the selected objects, or of all shown objects if none is selected; null: values are still loading. */
  csv(): string | null {
    const { selected } = this.view;
    return objectsCsv(this.table, selected.length > 0 ? selected : this.shown);
  }

  /** Legend of the colours; null: no column colours the objects, or it is still loading. */
  get legend(): ColorLegend | null {
    const column = this.table.column(this.colorBy);
    const bytes = column && this.table.bytes(column.id);
    return column && bytes && colorLegend(column, bytes, this.flags, this.view);
  }

  /** Some of the objects' colours in the legend's order, for a swatch; empty: all have the channel's colour. */
  colorsBeside({ color, original }: Pick<ChannelState, "color" | "original">): readonly string[] {
    if (this.colorBy !== "") return this.legend?.rows.flatMap(({ colors }) => colors) ?? [];
    return color.every((v, i) => v === original[i]) ? this.stageColors : [];
  }

  linked(view: ObjectView): ReturnType<typeof writeLinked> {
    return writeLinked(view, this.table);
  }

  retryFailed(): void {
    this.table.retryFailed();
  }

  dispose(): void {
    this.material.dispose();
  }
}
