/** Ties the state to the GPU: one scene, drawn only when something has changed. */
import { type Camera, Matrix4, PerspectiveCamera, Vector2, Vector3, WebGLRenderer } from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import type { Snapshot } from "./api";
import { BundleError } from "./bundle/errors";
import type { Bundle } from "./bundle/load";
import { listenForClicks, rayAhead, rayUnder } from "./gaze/aim";
import { pickTile, type Ray } from "./gaze/pick";
import { SurfaceLoader } from "./mesh/loader";
import { ERROR_TARGET_PX, ERROR_TARGET_XR_PX, SurfaceSet } from "./mesh/surface_set";
import { type Action, initialState, reduce, type ViewerState, volumeChannels } from "./state";
import { DepthPass } from "./view/depth_pass";
import { framingDistance, place, XR_DISTANCE_M } from "./view/placement";
import { Room } from "./view/room";
import { VolumeSet } from "./volume/volume_set";
import { XrSession } from "./xr/session";

const FIELD_OF_VIEW_DEG = 40;
/** A phone's third pixel in each direction costs more than it shows. */
const MAX_PIXEL_RATIO = 2;

export class Viewer {
  readonly renderer: WebGLRenderer;
  readonly xr: XrSession;
  state: ViewerState;
  frames = 0;
  private readonly camera = new PerspectiveCamera(FIELD_OF_VIEW_DEG, 1, 0.01, 20);
  private readonly controls: OrbitControls;
  private readonly room: Room;
  private readonly depth = new DepthPass();
  private readonly surfaceLoader: SurfaceLoader;
  private readonly surfaces: SurfaceSet;
  private readonly volumes: VolumeSet;
  private readonly resize: ResizeObserver;
  private readonly disposed = new AbortController();
  private readonly size = new Vector2();
  private readonly point = new Vector3();
  private readonly toSpecimen = new Matrix4();
  private isStale = true;
  /** Whether the start view still holds: then it follows the window's shape. */
  private isHome = true;
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

    const refresh = () => {
      this.isStale = true;
    };
    const fail = (error: unknown) => this.report(error);
    const gl = this.renderer.getContext() as WebGL2RenderingContext;
    this.room = new Room(manifest);
    this.surfaceLoader = new SurfaceLoader(this.renderer);
    this.volumes = new VolumeSet(
      bundle,
      this.depth.texture,
      gl.getParameter(gl.MAX_3D_TEXTURE_SIZE) as number,
      () => {
        this.surfaces.follow(this.state); // a surface goes when its volume has come
        refresh();
      },
      fail,
    );
    this.surfaces = new SurfaceSet(
      bundle,
      this.surfaceLoader,
      (tile, channel) => this.volumes.has(tile, channel),
      refresh,
      fail,
    );
    this.room.specimen.add(this.surfaces.group, this.volumes.group);

    this.controls = new OrbitControls(this.camera, this.renderer.domElement);
    this.controls.enableDamping = true;
    this.controls.dampingFactor = 0.12;
    this.controls.minDistance = 0.05;
    this.controls.maxDistance = 8;
    this.controls.addEventListener("change", refresh);
    this.controls.addEventListener("start", () => {
      this.isHome = false;
    });
    this.xr = new XrSession(
      this.renderer,
      () => this.enterStereo(),
      () => this.leaveStereo(),
      () => this.chooseTile(rayAhead(this.renderer.xr.getCamera().matrixWorld, this.room.specimen)),
    );
    listenForClicks(this.renderer.domElement, (point) => {
      if (this.xr.isRunning) return;
      this.chooseTile(rayUnder(point, this.camera, this.room.specimen));
    });
    this.renderer.domElement.addEventListener("webglcontextlost", () => {
      const text = "The graphics driver has dropped the picture: reload the page.";
      this.dispatch({ type: "notify", text });
    });
    this.resize = new ResizeObserver(() => this.fit());
    this.resize.observe(stage);
    this.followPixelRatio();
    this.fit();
    this.follow();
    this.renderer.setAnimationLoop(() => this.frame());
  }

  dispatch(action: Action): void {
    const next = reduce(this.state, action);
    if (next === this.state) return;
    this.state = next;
    this.follow();
    this.onState(next);
  }

  snapshot(): Snapshot {
    return {
      state: this.state,
      overview: this.surfaces.overview,
      isLoading: this.isLoading,
      triangles: this.surfaces.triangles,
      volumes: this.volumes.status(),
      isStereo: this.xr.isRunning,
    };
  }

  /** Resolves when nothing loads any more and the picture shows all of it. */
  settled(): Promise<void> {
    this.isStale = true;
    return new Promise((resolve) => this.waiting.push(resolve));
  }

  /** The whole specimen from the front: x to the right, y up. */
  resetView(): void {
    const { size } = place(this.bundle.manifest.specimen.bounds_um);
    const fov = (FIELD_OF_VIEW_DEG * Math.PI) / 180;
    this.controls.target.set(0, 0, 0);
    this.camera.position.set(0, 0, framingDistance(size, fov, this.camera.aspect));
    this.camera.up.set(0, 1, 0);
    this.controls.update();
    this.isHome = true;
    this.isStale = true;
  }

  report(error: unknown): void {
    if (!(error instanceof BundleError)) throw error;
    this.dispatch({ type: "notify", text: error.message });
  }

  private get isLoading(): boolean {
    return this.surfaces.isLoading || this.volumes.isLoading || !this.surfaces.overview.isComplete;
  }

  private follow(): void {
    this.volumes.follow(this.state);
    this.surfaces.follow(this.state);
    const { scope, tile } = this.state;
    const isMarked = scope === "one" && volumeChannels(this.state).length > 0;
    this.room.mark(isMarked ? tile : null);
    this.isStale = true;
  }

  private frame(): void {
    const isStereo = this.renderer.xr.isPresenting;
    if (!isStereo) this.controls.update();
    const wasLoading = this.isLoading;
    if (!isStereo && !this.isStale && !wasLoading) return;
    this.updateSurfaces();
    if (isStereo || this.isStale) {
      this.isStale = false;
      this.draw(isStereo ? this.xr.camera : this.camera);
      this.frames++;
      this.onFrame();
    }
    if (this.waiting.length > 0 && !this.isLoading && !this.isStale) {
      for (const resolve of this.waiting.splice(0)) resolve();
    }
  }

  private updateSurfaces(): void {
    if (!this.renderer.xr.isPresenting) {
      this.renderer.getDrawingBufferSize(this.size);
      this.camera.updateMatrixWorld();
      this.surfaces.update(this.camera, this.size.x, this.size.y);
      return;
    }
    const both = this.renderer.xr.getCamera();
    const viewport = both.cameras[0]?.viewport;
    if (viewport) this.surfaces.update(both, viewport.z, viewport.w);
  }

  private draw(camera: Camera): void {
    const { scene } = this.room;
    this.renderer.info.reset();
    const eye = this.eye(camera);
    this.room.light(eye);
    if (!this.volumes.isEmpty) {
      const toSpecimen = this.toSpecimen.copy(this.room.specimen.matrixWorld).invert();
      this.volumes.sortBy(this.point.setFromMatrixPosition(eye).applyMatrix4(toSpecimen));
      this.measureFrameBuffer();
      const hidden = [...this.room.overlays, this.volumes.group];
      this.depth.render(this.renderer, scene, camera, hidden, this.size.x, this.size.y);
    }
    this.renderer.render(scene, camera);
  }

  /** A headset's frame buffer is as large as its eyes' viewports reach, whatever the canvas is. */
  private measureFrameBuffer(): void {
    this.renderer.getDrawingBufferSize(this.size);
    if (!this.renderer.xr.isPresenting) return;
    for (const { viewport } of this.renderer.xr.getCamera().cameras) {
      if (!viewport) continue;
      this.size.x = Math.max(this.size.x, viewport.x + viewport.z);
      this.size.y = Math.max(this.size.y, viewport.y + viewport.w);
    }
  }

  /** Pose of the head, or of the mono camera. */
  private eye(camera: Camera): Matrix4 {
    return this.renderer.xr.isPresenting
      ? this.renderer.xr.getCamera().matrixWorld
      : camera.matrixWorld;
  }

  private fit(): void {
    if (this.renderer.xr.isPresenting) return;
    const { clientWidth, clientHeight } = this.stage;
    if (clientWidth === 0 || clientHeight === 0) return;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, MAX_PIXEL_RATIO));
    this.renderer.setSize(clientWidth, clientHeight);
    this.camera.aspect = clientWidth / clientHeight;
    this.camera.updateProjectionMatrix();
    if (this.isHome) this.resetView();
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
    this.controls.enabled = false;
    this.room.moveTo(new Vector3(0, 0, -XR_DISTANCE_M));
    this.surfaces.setErrorTarget(ERROR_TARGET_XR_PX);
    this.onState(this.state);
  }

  private leaveStereo(): void {
    this.controls.enabled = true;
    this.room.moveTo(new Vector3());
    this.surfaces.setErrorTarget(ERROR_TARGET_PX);
    this.fit();
    this.isStale = true;
    this.onState(this.state);
  }

  private chooseTile(ray: Ray): void {
    const tile = pickTile(ray, this.bundle.manifest.tiles);
    if (tile !== null) this.dispatch({ type: "choose-tile", tile });
  }

  dispose(): void {
    this.renderer.setAnimationLoop(null);
    this.resize.disconnect();
    this.disposed.abort();
    this.controls.dispose();
    this.surfaces.dispose();
    this.volumes.dispose();
    this.surfaceLoader.dispose();
    this.depth.dispose();
    this.renderer.dispose();
    this.renderer.domElement.remove();
  }
}
