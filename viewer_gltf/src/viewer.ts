/** Ties the state to the GPU: one scene, drawn only when something has changed. */
import { type Camera, type Matrix4, Vector3, WebGLRenderer } from "three";
import type { Snapshot } from "./api";
import { BundleError } from "./bundle/errors";
import type { Bundle } from "./bundle/load";
import { listenForClicks, rayAhead, rayUnder } from "./gaze/aim";
import { pickTile, type Ray } from "./gaze/pick";
import { Hybrid } from "./hybrid/hybrid";
import { wantedTiles } from "./hybrid/who";
import { SurfaceLoader } from "./mesh/loader";
import { ERROR_TARGET_PX, ERROR_TARGET_XR_PX, SurfaceSet } from "./mesh/surface_set";
import { Pace } from "./quality/pace";
import { type Action, initialState, reduce, type ViewerState } from "./state";
import type { Command } from "./ui/commands";
import { type Look, Navigation } from "./view/navigation";
import { Picture } from "./view/picture";
import { place, XR_DISTANCE_M } from "./view/placement";
import { Room } from "./view/room";
import { StageSize } from "./view/stage_size";
import { volumeBudget } from "./volume/levels";
import { VolumeSet } from "./volume/volume_set";
import type { Profile } from "./xr/cardboard/profile";
import type { SplitSession } from "./xr/cardboard/split_session";
import { XrSession } from "./xr/session";

/** A phone's third pixel in each direction costs more than it shows. */
const MAX_PIXEL_RATIO = 2;
/** A page that slept has not been looked at for as long. */
const LONGEST_FRAME_S = 0.1;

export class Viewer {
  readonly renderer: WebGLRenderer;
  readonly xr: XrSession;
  readonly navigation: Navigation;
  state: ViewerState;
  frames = 0;
  private split: SplitSession | null = null;
  private readonly room: Room;
  private readonly picture: Picture;
  private readonly hybrid: Hybrid;
  private readonly pace: Pace;
  private readonly surfaceLoader: SurfaceLoader;
  private readonly surfaces: SurfaceSet;
  private readonly volumes: VolumeSet;
  private readonly size: StageSize;
  private last_ms = 0;
  private isStale = true;
  /** Whether the frame before was one of a moving picture, drawn in its budget. */
  private wasMoving = false;
  private waiting: (() => void)[] = [];

  /**
   * @param onState called after every change of the state
   * @param onFrame called after every frame drawn
   */
  constructor(
    readonly bundle: Bundle,
    private readonly stage: HTMLElement,
    private readonly onState: (state: ViewerState) => void,
    private readonly onFrame: () => void,
  ) {
    const { manifest } = bundle;
    this.state = initialState(manifest);
    this.renderer = new WebGLRenderer({ antialias: true, powerPreference: "high-performance" });
    this.renderer.info.autoReset = false;
    stage.append(this.renderer.domElement);
    const gl = this.renderer.getContext() as WebGL2RenderingContext;
    const canvas = this.renderer.domElement;

    const refresh = () => {
      this.isStale = true;
    };
    const fail = (error: unknown) => this.report(error);
    this.room = new Room(manifest);
    this.hybrid = new Hybrid(manifest);
    this.picture = new Picture(this.renderer, this.room, this.hybrid);
    this.pace = new Pace(gl);
    this.surfaceLoader = new SurfaceLoader(this.renderer);
    this.volumes = new VolumeSet(
      bundle,
      this.picture.marchFrame,
      {
        bytes: volumeBudget(navigator),
        side: gl.getParameter(gl.MAX_3D_TEXTURE_SIZE) as number,
      },
      refresh,
      fail,
    );
    this.surfaces = new SurfaceSet(
      bundle,
      this.surfaceLoader,
      this.picture.surfaceFrame,
      (tile, channel) => this.volumes.presence(tile, channel),
      refresh,
      fail,
    );
    this.room.specimen.group.add(this.surfaces.group);

    this.navigation = new Navigation(canvas, place(manifest.specimen.bounds_um), refresh);
    this.xr = new XrSession(
      this.renderer,
      () => this.enterStereo(),
      () => this.leaveStereo(),
      () => this.choose(rayAhead(this.head, this.room.specimen.group)),
    );
    listenForClicks(canvas, (point) => {
      if (this.stereo !== null) return;
      this.choose(rayUnder(point, this.navigation.camera, this.room.specimen.group));
    });
    const lost = "The graphics driver has dropped the picture: it is drawn anew.";
    canvas.addEventListener("webglcontextlost", () =>
      this.dispatch({ type: "notify", text: lost }),
    );
    canvas.addEventListener("webglcontextrestored", () => {
      this.volumes.forget(); // their texels went with the context
      this.follow();
      this.dispatch({ type: "dismiss", text: lost });
    });
    this.size = new StageSize(stage, () => this.fit());
    this.fit();
    this.follow();
    this.renderer.setAnimationLoop((time_ms) => this.frame(time_ms));
  }

  dispatch(action: Action): void {
    const next = reduce(this.state, action);
    if (next === this.state) return;
    this.state = next;
    this.follow();
    this.onState(next);
  }

  /** Do what is no change of the state; whether this was one of the viewer's commands. */
  run(command: Command): boolean {
    switch (command) {
      case "reset":
        this.dispatch({ type: "isolate", tile: null });
        this.room.specimen.goHome();
        this.navigation.reset();
        break;
      case "back":
        if (this.state.isolated !== null) this.dispatch({ type: "isolate", tile: null });
        else this.dispatch({ type: "select", tile: null });
        break;
      default:
        if (!this.navigation.run(command)) return false;
    }
    this.isStale = true;
    return true;
  }

  get look(): Look {
    return this.navigation.look;
  }

  lookFrom(look: Look): void {
    this.navigation.lookFrom(look);
    this.isStale = true;
  }

  snapshot(): Snapshot {
    return {
      state: this.state,
      overview: this.surfaces.overview,
      isLoading: this.isLoading,
      triangles: this.surfaces.triangles,
      volumes: this.volumes.status(),
      volumeBytes: this.volumes.bytes,
      gazed: this.hybrid.nearby.gazed,
      discRadius_deg: (this.hybrid.outer_rad * 180) / Math.PI,
      frame_ms: this.pace.frame_ms,
      isStereo: this.stereo !== null,
    };
  }

  /** Resolves when nothing loads any more and the picture shows all of it. */
  settled(): Promise<void> {
    this.isStale = true;
    return new Promise((resolve) => this.waiting.push(resolve));
  }

  report(error: unknown): void {
    if (!(error instanceof BundleError)) throw error;
    this.dispatch({ type: "notify", text: error.message });
  }

  private get stereo(): "headset" | "split" | null {
    if (this.renderer.xr.isPresenting) return "headset";
    return this.split?.isRunning ? "split" : null;
  }

  /**
   * Split screen for a phone in a viewer without WebXR. Must be called from a tap. Throws
   * BundleError in words if the browser or the user refuses.
   */
  async startSplit(profile: Profile): Promise<void> {
    if (this.split === null) {
      const { SplitSession } = await import("./xr/cardboard/split_session");
      this.split ??= new SplitSession(
        this.renderer,
        () => this.enterStereo(),
        () => this.leaveStereo(),
        () => this.choose(rayAhead(this.head, this.room.specimen.group)),
      );
    }
    await this.split.start(profile);
    for (const text of this.split.problems) this.dispatch({ type: "notify", text });
  }

  private get isLoading(): boolean {
    return this.surfaces.isLoading || this.volumes.isLoading || !this.surfaces.overview.isComplete;
  }

  private follow(): void {
    const { nearby, mayRefine } = this.hybrid;
    const { isolated, selected, quality } = this.state;
    const tile = this.bundle.manifest.tiles.find(({ id }) => id === isolated);
    this.room.specimen.show(tile?.bounds_um ?? null);
    this.volumes.follow(this.state, wantedTiles(this.state, nearby), mayRefine);
    this.surfaces.follow(this.state, nearby);
    this.room.mark(isolated === null ? selected : null);
    this.pace.setLevel(quality);
    this.isStale = true;
  }

  private frame(time_ms: number): void {
    const interval_ms = time_ms - this.last_ms;
    const dt_s = Math.min(LONGEST_FRAME_S, Math.max(0, interval_ms / 1000));
    this.last_ms = time_ms;
    const { stereo } = this;
    const wasLoading = this.isLoading;
    const camera = this.pose(stereo);
    const isChanging = this.advance(dt_s);
    if (stereo === null && !this.isStale && !wasLoading && !this.wasMoving) return;
    // a picture that came to rest is drawn once more, as well as can be
    const isMoving = stereo !== null || this.isStale;
    const settings = this.pace.begin(isMoving, interval_ms, this.xr.rate_hz);
    const target_px = stereo === null ? ERROR_TARGET_PX : ERROR_TARGET_XR_PX;
    this.surfaces.setErrorTarget(target_px * settings.errorFactor);
    this.picture.marchFrame.uSteps.value = settings.steps;
    this.hybrid.radiusShare = settings.discShare;
    this.updateSurfaces(camera);
    if (isMoving || this.wasMoving) {
      this.isStale = isChanging;
      this.draw(camera, settings.resolution);
      this.frames++;
      this.onFrame();
    }
    this.pace.end();
    this.wasMoving = isMoving;
    const isAtRest = stereo !== null || !isMoving;
    if (this.waiting.length > 0 && !this.isLoading && !this.isStale && isAtRest) {
      for (const resolve of this.waiting.splice(0)) resolve();
    }
  }

  /** Where the eyes are in this frame; returns the camera to draw with. */
  private pose(stereo: "headset" | "split" | null): Camera {
    const { eyes } = this.picture;
    if (stereo === "headset") {
      eyes.followHeadset(this.renderer, this.xr.camera);
      return this.xr.camera;
    }
    if (stereo === "split" && this.split !== null) {
      this.split.update();
      eyes.follow(this.split.eyes.map(({ camera, viewport }) => [camera, viewport]));
      return this.split.camera;
    }
    this.navigation.update();
    eyes.followScreen(this.renderer, this.navigation.camera);
    return this.navigation.camera;
  }

  /** Follow the gaze, and go on with what moves or fades; whether the next frame differs by itself. */
  private advance(dt_s: number): boolean {
    const { hybrid, volumes, state } = this;
    const { specimen } = this.room;
    const isMoving = specimen.advance(dt_s);
    const isReady = (tile: string) => volumes.isReady(tile);
    if (hybrid.look(state, this.head, specimen.group.matrixWorld, isReady, dt_s)) this.follow();
    const isFading = volumes.advance(dt_s);
    const isChanging = isMoving || isFading || hybrid.isChanging(state);
    if (isChanging) this.isStale = true;
    if (this.isStale) this.surfaces.dressAll();
    return isChanging;
  }

  private updateSurfaces(camera: Camera): void {
    const { viewport } = this.picture.eyes.all[0] ?? {};
    // three moves the headset's cameras, not the one that it is given
    const seen = this.renderer.xr.isPresenting ? this.renderer.xr.getCamera() : camera;
    if (viewport) this.surfaces.update(seen, viewport.z, viewport.w);
  }

  private draw(camera: Camera, resolution: number): void {
    const { split, volumes, state } = this;
    const isSplit = this.stereo === "split" && split !== null;
    if (isSplit) this.renderer.setRenderTarget(split.target);
    this.picture.draw(camera, this.head, volumes, this.surfaces.blended, state.clip, resolution);
    if (!isSplit) return;
    this.renderer.setRenderTarget(null);
    split.present();
  }

  /** Pose of the head, or of the mono camera. */
  private get head(): Matrix4 {
    if (this.renderer.xr.isPresenting) return this.renderer.xr.getCamera().matrixWorld;
    if (this.split?.isRunning) return this.split.camera.matrixWorld;
    return this.navigation.camera.matrixWorld;
  }

  private fit(): void {
    if (this.renderer.xr.isPresenting) return;
    const { clientWidth, clientHeight } = this.stage;
    if (clientWidth === 0 || clientHeight === 0) return;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, MAX_PIXEL_RATIO));
    this.renderer.setSize(clientWidth, clientHeight);
    this.navigation.fit(clientWidth / clientHeight);
    this.isStale = true;
  }

  private enterStereo(): void {
    this.navigation.controls.enabled = false;
    this.room.specimen.anchorAt(new Vector3(0, 0, -XR_DISTANCE_M));
    this.onState(this.state);
  }

  private leaveStereo(): void {
    this.navigation.controls.enabled = true;
    this.room.specimen.anchorAt(new Vector3());
    this.fit();
    this.onState(this.state);
  }

  /** Select what the ray meets first; what is selected already is isolated. */
  private choose(ray: Ray): void {
    const { isolated, selected } = this.state;
    if (isolated !== null) return;
    const tile = pickTile(ray, this.bundle.manifest.tiles);
    if (tile === null) return;
    if (tile === selected) this.dispatch({ type: "isolate", tile });
    else this.dispatch({ type: "select", tile });
  }

  dispose(): void {
    this.renderer.setAnimationLoop(null);
    this.size.dispose();
    this.split?.dispose();
    this.navigation.dispose();
    this.surfaces.dispose();
    this.volumes.dispose();
    this.surfaceLoader.dispose();
    this.picture.dispose();
    this.pace.dispose();
    this.renderer.dispose();
    this.renderer.domElement.remove();
  }
}
