/** Ties the state to the GPU: one scene, drawn only when something has changed. */
import { type Camera, Matrix4, Vector3, WebGLRenderer } from "three";
import type { Snapshot } from "./api";
import { BundleError } from "./bundle/errors";
import type { Bundle } from "./bundle/load";
import { listenForClicks, rayAhead, rayUnder } from "./gaze/aim";
import { pickTile, type Ray } from "./gaze/pick";
import { Hybrid } from "./hybrid/hybrid";
import { wantedTiles } from "./hybrid/who";
import { makeSurfaceFrame } from "./mesh/blend";
import { SurfaceLoader } from "./mesh/loader";
import { ERROR_TARGET_PX, ERROR_TARGET_XR_PX, SurfaceSet } from "./mesh/surface_set";
import { Pace } from "./quality/pace";
import { type Action, initialState, reduce, type ViewerState } from "./state";
import type { Command } from "./ui/commands";
import { Cuts } from "./view/cuts";
import { DepthPass } from "./view/depth_pass";
import { Eyes } from "./view/eyes";
import { MarchPass } from "./view/march_pass";
import { type Look, Navigation } from "./view/navigation";
import { place, XR_DISTANCE_M } from "./view/placement";
import { Room } from "./view/room";
import { volumeBudget } from "./volume/levels";
import { makeFrame } from "./volume/tile_march";
import { VolumeSet } from "./volume/volume_set";
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
  private readonly room: Room;
  private readonly eyes = new Eyes();
  private readonly cuts = new Cuts();
  private readonly depth: DepthPass;
  private readonly marchFrame;
  private readonly march: MarchPass;
  private readonly surfaceFrame;
  private readonly hybrid: Hybrid;
  private readonly pace: Pace;
  private readonly surfaceLoader: SurfaceLoader;
  private readonly surfaces: SurfaceSet;
  private readonly volumes: VolumeSet;
  private readonly resize: ResizeObserver;
  private readonly disposed = new AbortController();
  private readonly point = new Vector3();
  private readonly toSpecimen = new Matrix4();
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
    this.depth = new DepthPass(this.cuts);
    this.marchFrame = makeFrame(this.depth.texture);
    this.march = new MarchPass(this.marchFrame);
    this.surfaceFrame = makeSurfaceFrame(this.marchFrame.uDisc, this.cuts);
    this.hybrid = new Hybrid(manifest);
    this.pace = new Pace(gl);
    this.surfaceLoader = new SurfaceLoader(this.renderer);
    this.volumes = new VolumeSet(
      bundle,
      this.marchFrame,
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
      this.surfaceFrame,
      (tile, channel) => this.volumes.presence(tile, channel),
      refresh,
      fail,
    );
    this.room.specimen.group.add(this.surfaces.group);
    this.room.scene.add(this.march.overlay);

    this.navigation = new Navigation(canvas, place(manifest.specimen.bounds_um), refresh);
    this.xr = new XrSession(
      this.renderer,
      () => this.enterStereo(),
      () => this.leaveStereo(),
      () => this.choose(rayAhead(this.head, this.room.specimen.group)),
    );
    listenForClicks(canvas, (point) => {
      if (this.xr.isRunning) return;
      this.choose(rayUnder(point, this.navigation.camera, this.room.specimen.group));
    });
    canvas.addEventListener("webglcontextlost", () => {
      const text = "The graphics driver has dropped the picture: reload the page.";
      this.dispatch({ type: "notify", text });
    });
    this.resize = new ResizeObserver(() => this.fit());
    this.resize.observe(stage);
    this.followPixelRatio();
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
      isStereo: this.xr.isRunning,
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
    const isStereo = this.renderer.xr.isPresenting;
    const wasLoading = this.isLoading;
    this.pose(isStereo);
    const isChanging = this.advance(dt_s);
    if (!isStereo && !this.isStale && !wasLoading && !this.wasMoving) return;
    // a picture that came to rest is drawn once more, as well as can be
    const isMoving = isStereo || this.isStale;
    const settings = this.pace.begin(isMoving, interval_ms, this.xr.rate_hz);
    const target_px = isStereo ? ERROR_TARGET_XR_PX : ERROR_TARGET_PX;
    this.surfaces.setErrorTarget(target_px * settings.errorFactor);
    this.marchFrame.uSteps.value = settings.steps;
    this.hybrid.radiusShare = settings.discShare;
    this.updateSurfaces(isStereo);
    if (isMoving || this.wasMoving) {
      this.isStale = isChanging;
      this.draw(isStereo ? this.xr.camera : this.navigation.camera, settings.resolution);
      this.frames++;
      this.onFrame();
    }
    this.pace.end();
    this.wasMoving = isMoving;
    const isAtRest = isStereo || !isMoving;
    if (this.waiting.length > 0 && !this.isLoading && !this.isStale && isAtRest) {
      for (const resolve of this.waiting.splice(0)) resolve();
    }
  }

  /** Where the eyes are in this frame. */
  private pose(isStereo: boolean): void {
    if (isStereo) {
      this.eyes.followHeadset(this.renderer, this.xr.camera);
      return;
    }
    this.navigation.update();
    this.eyes.followScreen(this.renderer, this.navigation.camera);
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

  private updateSurfaces(isStereo: boolean): void {
    if (!isStereo) {
      this.surfaces.update(this.navigation.camera, this.eyes.width_px, this.eyes.height_px);
      return;
    }
    const viewport = this.eyes.all[0]?.viewport;
    if (viewport) this.surfaces.update(this.renderer.xr.getCamera(), viewport.z, viewport.w);
  }

  private draw(camera: Camera, resolution: number): void {
    const { scene, specimen } = this.room;
    this.renderer.info.reset();
    this.room.light(this.head);
    this.cuts.follow(this.state.clip, specimen.group.matrixWorld);
    this.surfaceFrame.uApex.value.copy(this.hybrid.apex);
    this.surfaceFrame.uAxis.value.copy(this.hybrid.axis);
    this.surfaceFrame.uDisc.value.set(...this.hybrid.cosines);
    this.march.overlay.visible = !this.volumes.isEmpty;
    if (!this.volumes.isEmpty) this.drawVolumes(specimen.group.matrixWorld, resolution);
    this.renderer.render(scene, camera);
  }

  private drawVolumes(specimen: Matrix4, resolution: number): void {
    const { hybrid, volumes } = this;
    const toSpecimen = this.toSpecimen.copy(specimen).invert();
    const eye = this.point.setFromMatrixPosition(this.head).applyMatrix4(toSpecimen);
    volumes.placeAs(specimen);
    volumes.aim(eye, hybrid.apex_um, hybrid.axis_um, this.cuts.march);
    const hidden = [...this.room.overlays, this.march.overlay, ...this.surfaces.blended];
    this.depth.render(this.renderer, this.room.scene, this.eyes, hidden);
    this.march.render(this.renderer, volumes.scene, this.eyes, resolution);
  }

  /** Pose of the head, or of the mono camera. */
  private get head(): Matrix4 {
    return this.renderer.xr.isPresenting
      ? this.renderer.xr.getCamera().matrixWorld
      : this.navigation.camera.matrixWorld;
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

  /** A window may go to another screen, or be zoomed, at the same size. */
  private followPixelRatio(): void {
    const { signal } = this.disposed;
    const listen = () =>
      matchMedia(`(resolution: ${devicePixelRatio}dppx)`).addEventListener("change", follow, {
        once: true,
        signal,
      });
    const follow = () => {
      this.fit();
      listen();
    };
    listen();
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
    this.resize.disconnect();
    this.disposed.abort();
    this.navigation.dispose();
    this.surfaces.dispose();
    this.volumes.dispose();
    this.surfaceLoader.dispose();
    this.depth.dispose();
    this.march.dispose();
    this.pace.dispose();
    this.renderer.dispose();
    this.renderer.domElement.remove();
  }
}
