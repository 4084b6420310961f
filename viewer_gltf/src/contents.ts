/** What is shown of a bundle: its surfaces, its volumes, and the marks on them. */
import type { Camera, WebGLRenderer } from "three";
import type { Bundle } from "./bundle/load";
import type { Hybrid } from "./hybrid/hybrid";
import { wantedTiles } from "./hybrid/who";
import { Marks, type MarksView } from "./marks/marks";
import { SurfaceLoader } from "./mesh/loader";
import { SurfaceSet } from "./mesh/surface_set";
import { memoryBudget } from "./quality/memory";
import type { Action, ViewerState } from "./state";
import type { Picture } from "./view/picture";
import { VolumeSet } from "./volume/volume_set";

export type ContentsOptions = Readonly<{
  bundle: Bundle;
  renderer: WebGLRenderer;
  picture: Picture;
  state: ViewerState;
  dispatch: (action: Action) => void;
  /** The picture is no longer true. */
  onChange: () => void;
  onError: (error: unknown) => void;
}>;

export class Contents {
  readonly surfaces: SurfaceSet;
  readonly volumes: VolumeSet;
  readonly marks: Marks;
  private readonly loader: SurfaceLoader;
  /** Volumes come after the first picture of all tiles. */
  private hasOverview = false;

  constructor(options: ContentsOptions) {
    const { bundle, renderer, picture, onChange, onError } = options;
    const gl = renderer.getContext() as WebGL2RenderingContext;
    this.loader = new SurfaceLoader(renderer);
    const side: number = gl.getParameter(gl.MAX_3D_TEXTURE_SIZE);
    const budget = memoryBudget(navigator);
    const limits = { bytes: budget.volumes, side };
    this.volumes = new VolumeSet(bundle, picture.marchFrame, limits, onChange, onError);
    this.surfaces = new SurfaceSet(
      bundle,
      this.loader,
      picture.surfaceFrame,
      budget.surfaces,
      (tile, channel) => this.volumes.presence(tile, channel),
      onChange,
      onError,
    );
    const reading = {
      manifest: bundle.manifest,
      base: bundle.base,
      surfaces: () => this.surfaces.meshes,
      volumes: () => this.volumes.shown(),
      source: (tile: string, channel: string) => this.volumes.source(tile, channel),
      sourceOf: (tile: string, channel: string) => this.volumes.sourceOf(tile, channel),
      dispatch: options.dispatch,
      onChange,
      onError,
    };
    this.marks = new Marks(reading, options.state);
  }

  get isLoading(): boolean {
    return this.surfaces.isLoading || this.volumes.isLoading || !this.surfaces.overview.isComplete;
  }

  follow(state: ViewerState, { nearby, mayRefine }: Hybrid): void {
    const wanted = this.hasOverview ? wantedTiles(state, nearby) : [];
    this.volumes.follow(state, wanted, mayRefine);
    this.surfaces.follow(state, nearby);
    this.marks.follow(state);
  }

  /** What has failed is asked for again; then `follow`. */
  retryFailed(): void {
    this.surfaces.retryFailed();
    this.volumes.retryFailed();
    this.marks.readAnew();
  }

  /** True once, when the overview has come: then `follow` again. */
  hasJustBegun(): boolean {
    if (this.hasOverview || !this.surfaces.overview.isComplete) return false;
    this.hasOverview = true;
    return true;
  }

  /** Go on with what fades; whether it does. */
  advance(view: MarksView): boolean {
    const isFading = this.volumes.advance(view.dt_s);
    this.marks.update(view);
    return isFading;
  }

  /** Stream the surfaces that the eye needs, down to an error on screen. */
  stream(camera: Camera, width_px: number, height_px: number, target_px: number): void {
    this.surfaces.setErrorTarget(target_px);
    this.surfaces.update(camera, width_px, height_px);
  }

  dispose(): void {
    this.marks.dispose();
    this.surfaces.dispose();
    this.volumes.dispose();
    this.loader.dispose();
  }
}
