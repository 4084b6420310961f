/** All forms in which parts draw the specimen. Each question goes to the forms that can answer it. */
import type { Manifest } from "../bundle/generated/bundle";
import { cornersOf } from "../math/box";
import { behindPlane, keptPoints } from "../math/clip";
import { extremePoints } from "../math/extreme_points";
import { shownBox } from "../math/pick";
import type { Vec3 } from "../math/vec3";
import type { BlendedScene } from "../render/blend_material";
import type { MarchedVolumes, TracedVolumes } from "../render/drawn_forms";
import type { ShownVolume } from "../state/on_screen";
import type { Progress } from "../state/overview_progress";
import type { ChannelState, ViewerState } from "../state/viewer_state";
import type { Form, StreamView } from "./form";

export class Forms {
  /** Whether the overview of all tiles is loaded. */
  hasOverview = false;
  /** Whether the outline of the opening view is final. */
  private isOutlined = false;
  /** The values for which `shownPoints` has last returned points. */
  private answeredFor: readonly unknown[] = [];

  constructor(
    private readonly parts: Readonly<{ forms: readonly Form[] }>,
    private readonly manifest: Manifest,
  ) {}

  private get all(): readonly Form[] {
    return this.parts.forms;
  }

  get overview(): Progress {
    const all = this.all.flatMap(({ overview = [] }) => overview);
    const sum = (key: "done" | "total") => all.reduce((total, each) => total + each[key], 0);
    const isComplete = all.every((each) => each.isComplete);
    return { done: sum("done"), total: sum("total"), isComplete };
  }

  /** Whether all tiles of the first shown channel are on screen. */
  get hasFirst(): boolean {
    return this.all.every(({ hasFirst = true }) => hasFirst);
  }

  get triangles(): number {
    return this.all.reduce((sum, { triangles = 0 }) => sum + triangles, 0);
  }

  get panes(): readonly BlendedScene[] {
    return this.all.flatMap(({ panes = [] }) => panes);
  }

  get marched(): MarchedVolumes | null {
    return this.all.flatMap(({ marched = [] }) => marched)[0] ?? null;
  }

  get traced(): TracedVolumes | null {
    return this.all.flatMap(({ traced = [] }) => traced)[0] ?? null;
  }

  /** Whether an unchanged view still gathers samples of light. */
  get isGathering(): boolean {
    return this.traced?.isGathering ?? false;
  }

  /** Limits volumes to a number of voxels along a tile's edge, from the next `sync` on. */
  limitEdge(edge: number): void {
    for (const form of this.all) form.limitEdge?.(edge);
  }

  /**
   * Returns the outermost points (um, world) of everything that is shown and not cut away, as far
   * as they are known. Returns null if none are known, or if nothing has improved since the last
   * call. A channel without a surface may fill the whole specimen.
   */
  outline(state: ViewerState): readonly Vec3[] | null {
    if (this.isOutlined) return null;
    const points = this.pointsOf(state);
    if (points === null) return null;
    this.isOutlined = this.hasOverview;
    if (points.length === 0) return null;
    const { plane } = state.clip;
    const kept = plane === null ? points : behindPlane(points, plane);
    return extremePoints([...kept, ...addedCorners(this.manifest)]);
  }

  /**
   * Returns points (um, world) whose box contains everything that is shown now; no points if
   * nothing is shown. Returns null if they are not known yet, or if nothing has changed since the
   * last call.
   */
  shownPoints(state: ViewerState): readonly Vec3[] | null {
    const { channels, mode, isolated, clip } = state;
    const inputs = [channels, mode, isolated, clip, this.hasOverview];
    if (inputs.every((each, i) => each === this.answeredFor[i])) return null;
    const points = this.pointsOf(state);
    if (points === null) return null;
    this.answeredFor = inputs;
    return keptPoints(points, clip, shownBox(this.manifest, isolated));
  }

  /** Returns the outermost points (um, world) of all shown channels, uncut; null: not known yet. */
  private pointsOf(state: ViewerState): readonly Vec3[] | null {
    const points: Vec3[] = [];
    for (const channel of state.channels.filter(({ shown }) => shown)) {
      const outline = this.outlineOf(state, channel);
      if (outline === null) return null;
      points.push(...outline);
    }
    return points;
  }

  private outlineOf(state: ViewerState, channel: ChannelState): readonly Vec3[] | null {
    const isBuilt = !state.tiles.some((tile) => tile.isUnfinished);
    if (isBuilt && !channel.hasSurface) return cornersOf(this.manifest.specimen.bounds_um);
    for (const form of this.all) {
      const points = form.outline?.(state, channel);
      if (points !== undefined) return points;
    }
    return []; // no part draws the channel
  }

  /** Returns true once, when the overview is complete. The caller then calls `sync` again. */
  hasJustBegun(): boolean {
    if (this.hasOverview || !this.overview.isComplete) return false;
    this.hasOverview = true;
    return true;
  }

  /** Advances the fades of all forms by some seconds. Returns whether anything still fades. */
  fade(fade_s: number): boolean {
    const fading = this.all.map((form) => form.fade?.(fade_s) ?? false);
    return fading.includes(true);
  }

  /** The volumes on screen. */
  get shownVolumes(): readonly ShownVolume[] {
    const { marched, traced } = this;
    return (traced?.isShown ? traced : marched)?.shown() ?? [];
  }

  /** Whether some data of the frame is not drawn at all, not even at a coarse resolution. */
  get isIncomplete(): boolean {
    return !this.overview.isComplete || this.all.some(({ isIncomplete = false }) => isIncomplete);
  }

  /** Drops the textures after the graphics context was lost. */
  forget(): void {
    for (const form of this.all) form.forget?.();
  }

  /** Updates the materials of all forms; called before each frame. */
  updateMaterials(): void {
    for (const form of this.all) form.updateMaterials?.();
  }

  /** Fetches the files that a view needs to keep its error on screen, and drops the others. */
  stream(view: StreamView): void {
    for (const form of this.all) form.stream?.(view);
  }
}

/** Largest widening of the view for additions on each side, as a multiple of the specimen's longest edge. */
const WIDEST = 0.5;

/**
 * Returns the corners (um, world) of the box around the additions of a stage layer. The box extends
 * the specimen's box by at most WIDEST on each side.
 */
function addedCorners({ additions, specimen: { bounds_um } }: Manifest): readonly Vec3[] {
  if (additions === undefined) return [];
  const longest = Math.max(...bounds_um.max.map((v, k) => v - bounds_um.min[k]));
  const within = (corner: readonly number[]): Vec3 => {
    const [x, y, z] = corner.map((v, k) =>
      Math.min(
        Math.max(v, bounds_um.min[k] - WIDEST * longest),
        bounds_um.max[k] + WIDEST * longest,
      ),
    );
    return [x, y, z];
  };
  const { min, max } = additions.bounds_um;
  return cornersOf({ min: within(min), max: within(max) });
}
