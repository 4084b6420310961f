/** The forms of a bundle: its surfaces, its volumes, and the volumes by paths of light. */
import { type Camera, Matrix4, Vector3, type WebGLRenderer } from "three";
import type { Manifest } from "../bundle/generated/bundle";
import type { Bundle } from "../bundle/load";
import { ValuesHost } from "../bundle/values_host";
import { memoryBudget } from "../gpu/memory_budget";
import { cornersOf } from "../math/box";
import { behindPlane, keptPoints } from "../math/clip";
import { extremePoints } from "../math/extreme_points";
import { shownBox } from "../math/pick";
import type { Vec3 } from "../math/vec3";
import { TracedVolume } from "../pathtrace/traced_volume";
import type { Picture } from "../render/frame_renderer";
import type { Hybrid } from "../render/gaze_focus";
import type { Action } from "../state/actions";
import type { ShownVolume } from "../state/on_screen";
import { wantedTiles, wantsSurface } from "../state/representation";
import { isTwoD } from "../state/transfer_functions_2d";
import { type ViewerState, volumeChannels } from "../state/viewer_state";
import { SurfaceLoader } from "../surfaces/gltf_loader";
import { SurfaceSet } from "../surfaces/surface_set";
import { TransferFunctions2dLoader } from "../volumes/transfer_functions_loader";
import { VolumeSet } from "../volumes/volume_set";
import { BrickService } from "../voxels/bricks/brick_service";
import type { BrickView } from "../voxels/bricks/protocol";

export type ContentsOptions = Readonly<{
  bundle: Bundle;
  renderer: WebGLRenderer;
  picture: Picture;
  dispatch: (action: Action) => void;
  /** The picture is no longer true. */
  onChange: () => void;
  onError: (error: unknown) => void;
}>;

export class Contents {
  readonly surfaces: SurfaceSet;
  readonly volumes: VolumeSet;
  /** The same volumes by paths of light, in the mode `traced`. */
  readonly traced: TracedVolume;
  /** Two-dimensional transfer functions. */
  readonly transferFunctions2d: TransferFunctions2dLoader;
  /** Voxels as they were measured; null: the host has none. */
  readonly values: ValuesHost | null;
  private readonly bricks: BrickService | null;
  private readonly clip = new Matrix4();
  private readonly point = new Vector3();
  private readonly ahead = new Vector3();
  private readonly loader: SurfaceLoader;
  /** Volumes come after the first picture of all tiles. */
  hasOverview = false;
  /** Whether it is known for good where all lies that shows at the opening. */
  private isOutlined = false;
  /** The parts of the state that `shownPoints` has answered for. */
  private asked: readonly unknown[] = [];
  private readonly manifest: Manifest;

  constructor(options: ContentsOptions) {
    const { bundle, renderer, picture, onChange, onError } = options;
    const gl = renderer.getContext() as WebGL2RenderingContext;
    this.loader = new SurfaceLoader(renderer);
    const side: number = gl.getParameter(gl.MAX_3D_TEXTURE_SIZE);
    const budget = memoryBudget(navigator);
    const limits = { bytes: budget.volumes, side, edge: Number.POSITIVE_INFINITY };
    this.bricks =
      bundle.bricks === undefined
        ? null
        : new BrickService(renderer, bundle.bricks, onChange, onError);
    const { marchFrame } = picture;
    this.volumes = new VolumeSet(bundle, marchFrame, limits, onChange, onError, this.bricks);
    const { uSceneDepth } = marchFrame;
    const { bricks } = this;
    this.traced = new TracedVolume(this.volumes, bricks, limits, uSceneDepth, onChange, onError);
    picture.add(this.traced.group);
    this.transferFunctions2d = new TransferFunctions2dLoader(
      bundle,
      (channel, transfer2d) => options.dispatch({ type: "learn-transfer-2d", channel, transfer2d }),
      onChange,
      onError,
    );
    this.surfaces = new SurfaceSet(
      bundle,
      this.loader,
      picture.surfaceFrame,
      budget,
      (tile, channel) => this.volumes.presence(tile, channel),
      () => this.volumes.marches.isInDisc,
      onChange,
      onError,
    );
    this.manifest = bundle.manifest;
    this.values = bundle.values === undefined ? null : new ValuesHost(bundle.values);
  }

  get isLoading(): boolean {
    return (
      this.surfaces.isLoading ||
      this.volumes.isLoading ||
      this.traced.isLoading ||
      this.transferFunctions2d.isLoading ||
      !this.surfaces.overview.isComplete
    );
  }

  sync(state: ViewerState, { focusTiles, mayRefine }: Hybrid): void {
    const wanted = this.hasOverview ? wantedTiles(state, focusTiles) : [];
    for (const channel of volumeChannels(state))
      if (isTwoD(channel)) this.transferFunctions2d.want(channel.id);
    this.volumes.follow(state, wanted, mayRefine);
    this.traced.follow(state);
    this.surfaces.follow(state, focusTiles);
  }

  /** Asks again for the files that have failed; then `sync`. */
  retryFailed(): void {
    this.surfaces.retryFailed();
    this.volumes.retryFailed();
    this.traced.retryFailed();
    this.transferFunctions2d.retryFailed();
  }

  /** Draw volumes of at most so many voxels along a tile's edge; then `sync`. */
  limitEdge(edge: number): void {
    this.volumes.limitEdge(edge);
    this.traced.limitEdge(edge);
  }

  /**
   * Returns the outermost points (um, world) of all that shows and is not cut away, as far as they are known.
   * Returns null if none are known, or if nothing has improved since the last call. A channel without a surface may
   * show in all of the specimen.
   */
  outline(state: ViewerState): readonly Vec3[] | null {
    if (this.isOutlined) return null;
    const points = this.pointsOf(state);
    if (points === null) return null;
    this.isOutlined = this.hasOverview;
    if (points.length === 0) return null;
    const { plane } = state.clip;
    return extremePoints(plane === null ? points : behindPlane(points, plane));
  }

  /**
   * Returns points (um, world) whose box holds what is shown now; no points if nothing is. Returns null if they are not
   * known yet, or if nothing has changed since the last call.
   */
  shownPoints(state: ViewerState): readonly Vec3[] | null {
    const { channels, mode, isolated, clip } = state;
    const asked = [channels, mode, isolated, clip, this.hasOverview];
    if (asked.every((each, i) => each === this.asked[i])) return null;
    const points = this.pointsOf(state);
    if (points === null) return null;
    this.asked = asked;
    return keptPoints(points, clip, shownBox(this.manifest, isolated));
  }

  /** Outermost points (um, world) of all channels that are shown, uncut; null: not known yet. */
  private pointsOf(state: ViewerState): readonly Vec3[] | null {
    const points: Vec3[] = [];
    for (const channel of state.channels.filter(({ shown }) => shown)) {
      const outline = !channel.hasSurface
        ? cornersOf(this.manifest.specimen.bounds_um)
        : wantsSurface(state, channel)
          ? this.surfaces.outline(channel.id)
          : this.volumes.outline(channel.id);
      if (outline === null) return null;
      points.push(...outline);
    }
    return points;
  }

  /** True once, when the overview has come: then `sync` again. */
  hasJustBegun(): boolean {
    if (this.hasOverview || !this.surfaces.overview.isComplete) return false;
    this.hasOverview = true;
    return true;
  }

  /** Goes on with what fades, by so long. Returns whether anything still fades. */
  advance(fade_s: number): boolean {
    const isFading = this.volumes.advance(fade_s);
    this.traced.advance(fade_s);
    return isFading;
  }

  /** The volumes on screen. */
  get shownVolumes(): readonly ShownVolume[] {
    return this.traced.isShown ? this.traced.shown() : this.volumes.shown();
  }

  /** Whether a part of the picture is missing, not merely coarse. */
  get isIncomplete(): boolean {
    return !this.surfaces.overview.isComplete || this.volumes.isIncomplete;
  }

  /** The graphics context is gone, and the texels with it. */
  forget(): void {
    this.volumes.forget();
    this.traced.forget();
  }

  /** Stream the surfaces that the eye needs, down to an error on screen. */
  stream(camera: Camera, width_px: number, height_px: number, target_px: number): void {
    this.surfaces.setErrorTarget(target_px);
    this.surfaces.update(camera, width_px, height_px);
    this.bricks?.look(this.viewOf(camera, height_px));
  }

  /** What a camera sees, in the specimen's um. */
  private viewOf(camera: Camera, height_px: number): BrickView {
    const { surfaces, clip, point, ahead } = this;
    const specimen = surfaces.group.matrixWorld;
    clip.multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse).multiply(specimen);
    const toSpecimen = specimen.clone().invert();
    point.setFromMatrixPosition(camera.matrixWorld).applyMatrix4(toSpecimen);
    ahead.set(0, 0, -1).transformDirection(camera.matrixWorld).transformDirection(toSpecimen);
    return {
      clip: clip.toArray(),
      eye: point.toArray(),
      gaze: ahead.toArray(),
      pixels_per_radian: (camera.projectionMatrix.elements[5] * height_px) / 2,
    };
  }

  dispose(): void {
    this.surfaces.dispose();
    this.volumes.dispose();
    this.traced.dispose();
    this.bricks?.dispose();
    this.loader.dispose();
  }
}
