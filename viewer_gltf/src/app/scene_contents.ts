/** The visible parts of a bundle: its surfaces, its volumes, and the marks on them. */
import { type Camera, Matrix4, Vector3, type WebGLRenderer } from "three";
import { Marks, type MarksView } from "../annotations/annotations";
import type { Manifest } from "../bundle/generated/bundle";
import type { Bundle } from "../bundle/load";
import { ValuesHost } from "../bundle/values_host";
import { memoryBudget } from "../gpu/memory_budget";
import { type Box, cornersOf } from "../math/box";
import { behindPlane, keptPoints } from "../math/clip";
import { extremePoints } from "../math/extreme_points";
import { shownBox } from "../math/pick";
import type { Vec3 } from "../math/vec3";
import { TracedVolume } from "../pathtrace/traced_volume";
import type { Picture } from "../render/frame_renderer";
import type { Hybrid } from "../render/gaze_focus";
import type { Action } from "../state/actions";
import { wantedTiles, wantsSurface } from "../state/representation";
import { isTwoD } from "../state/transfer_functions_2d";
import { type ViewerState, volumeChannels } from "../state/viewer_state";
import { SurfaceLoader } from "../surfaces/gltf_loader";
import { SurfaceSet } from "../surfaces/surface_set";
import { BrickService } from "../volumes/bricks/brick_service";
import type { BrickView } from "../volumes/bricks/protocol";
import { TransferFunctions2dLoader } from "../volumes/transfer_functions_loader";
import { VolumeSet } from "../volumes/volume_set";
import { ObjectsPart } from "./objects_part";
import { SlicesPart } from "./slices_part";

export type ContentsOptions = Readonly<{
  bundle: Bundle;
  renderer: WebGLRenderer;
  picture: Picture;
  state: ViewerState;
  /** The part of the page with the stage. */
  view: HTMLElement;
  dispatch: (action: Action, isStep?: boolean) => void;
  announce: (text: string) => void;
  onCard: (control: string) => void;
  /** An object is to be flown to, um, world; `isSeen`: whether nothing lies before it for an eye. */
  onAim: (box: Box, isSeen: (eye: Vec3) => boolean) => void;
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
  readonly marks: Marks;
  /** Pictures of the slices, and the planes that show them in the specimen. */
  readonly slices: SlicesPart;
  /** The objects of label maps. */
  readonly objects: ObjectsPart;
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
      () => this.volumes.isInDisc,
      onChange,
      onError,
    );
    this.objects = new ObjectsPart({
      ...options,
      ...bundle,
      surfaces: this.surfaces,
      specimen: () => this.surfaces.group.parent ?? this.surfaces.group,
    });
    const values = bundle.values === undefined ? null : new ValuesHost(bundle.values);
    const reading = {
      values,
      manifest: bundle.manifest,
      base: bundle.base,
      surfaces: () => this.surfaces.meshes,
      volumes: () => (this.traced.isShown ? this.traced.shown() : this.volumes.shown()),
      source: (tile: string, channel: string) => this.volumes.source(tile, channel),
      sourceOf: (tile: string, channel: string) => this.volumes.sourceOf(tile, channel),
      dispatch: options.dispatch,
      announce: options.announce,
      onChange,
      onError,
    };
    const { manifest, base } = bundle;
    this.manifest = manifest;
    const { sourceOf } = reading;
    const { view, dispatch } = options;
    this.slices = new SlicesPart({
      manifest,
      base,
      values,
      sourceOf,
      view,
      dispatch,
      onChange,
      onError,
    });
    const slices = () => this.slices.standing;
    const corner = (eye: Vec3) => this.slices.cornerTowards(eye);
    this.marks = new Marks({ ...reading, slices, corner }, options.state);
  }

  get isLoading(): boolean {
    return (
      this.surfaces.isLoading ||
      this.volumes.isLoading ||
      this.traced.isLoading ||
      this.transferFunctions2d.isLoading ||
      this.slices.isLoading ||
      this.objects.isLoading ||
      !this.surfaces.overview.isComplete
    );
  }

  follow(state: ViewerState, { focusTiles, mayRefine }: Hybrid): void {
    const wanted = this.hasOverview ? wantedTiles(state, focusTiles) : [];
    for (const channel of volumeChannels(state))
      if (isTwoD(channel)) this.transferFunctions2d.want(channel.id);
    this.volumes.follow(state, wanted, mayRefine);
    this.traced.follow(state);
    this.surfaces.follow(state, focusTiles);
    this.slices.follow(state);
    this.objects.follow(state);
    this.marks.follow(state);
  }

  /** Asks again for the parts that have failed; then `follow`. */
  retryFailed(): void {
    this.surfaces.retryFailed();
    this.volumes.retryFailed();
    this.traced.retryFailed();
    this.transferFunctions2d.retryFailed();
    this.slices.retryFailed();
    this.objects.retryFailed();
    this.marks.readAnew();
  }

  /** Draw volumes of at most so many voxels along a tile's edge; then `follow`. */
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

  /** True once, when the overview has come: then `follow` again. */
  hasJustBegun(): boolean {
    if (this.hasOverview || !this.surfaces.overview.isComplete) return false;
    this.hasOverview = true;
    return true;
  }

  /** Go on with what fades, by so long; whether it does. */
  advance(view: MarksView, fade_s: number): boolean {
    const isFading = this.volumes.advance(fade_s);
    this.traced.advance(fade_s);
    this.marks.update(view);
    this.slices.update(this.marks.sight);
    return isFading;
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
    this.marks.dispose();
    this.slices.dispose();
    this.objects.dispose();
    this.surfaces.dispose();
    this.volumes.dispose();
    this.traced.dispose();
    this.bricks?.dispose();
    this.loader.dispose();
  }
}
