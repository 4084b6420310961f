/** Ties the state to the GPU: one scene, drawn only when something has changed. */
import { type Camera, type Matrix4, Quaternion, type Vector2, Vector3, WebGLRenderer } from "three";
import type { HandleId } from "../annotations/clip_handles";
import { listenForHandles } from "../annotations/handle_pointer";
import { type LampHandle, lampHandles } from "../annotations/lamp_handles";
import { BundleError, TemporaryError } from "../bundle/errors";
import type { Bundle } from "../bundle/load";
import { Navigation } from "../interaction/orbit_camera";
import { listenForClicks, rayAhead, rayUnder } from "../interaction/rays";
import type { HandPose, SpecimenPose } from "../math/grab";
import { pickTile, shownBox, shownTiles } from "../math/pick";
import type { Ray } from "../math/vec3";
import type { Layout, PanelView } from "../panel/controls";
import { chosenTile } from "../panel/sections/tiles";
import { StageSize } from "../render/canvas_size";
import { type FramePace, Picture } from "../render/frame_renderer";
import { Hybrid } from "../render/gaze_focus";
import { Pace } from "../render/pacing/frame_budget";
import { RestPace } from "../render/pacing/redraw_at_rest";
import { GatherPace } from "../render/pacing/samples_per_frame";
import { place, XR_DISTANCE_M } from "../render/placement";
import { Room } from "../render/scene";
import { intoRoom, ontoScreen } from "../render/screen_to_room";
import type { Look } from "../share/camera_link";
import { remarkOn } from "../state/announce_change";
import { CANT, type Command } from "../state/commands";
import {
  type Action,
  initialState,
  newNotice,
  reduce,
  type ViewerState,
} from "../state/viewer_state";
import { ERROR_TARGET_PX } from "../surfaces/surface_set";
import type { Histogram } from "../volumes/transfer_functions_loader";
import type { Profile } from "../xr/cardboard/viewer_profile";
import { ahead } from "../xr/head_pose";
import { Stereo } from "../xr/stereo";
import type { Snapshot } from "./automation_api";
import { Contents } from "./scene_contents";

/** A phone's third pixel in each direction costs more than it shows. */
const MAX_PIXEL_RATIO = 2;
/** A page that slept has not been looked at for as long. */
const LONGEST_FRAME_S = 0.1;

const NO_LAYOUT: Layout = { title: "", subtitle: "", sections: [], status: "", isHidden: true };

export class Viewer {
  readonly renderer: WebGLRenderer;
  readonly stereo: Stereo;
  readonly navigation: Navigation;
  state: ViewerState;
  frames = 0;
  /** What a panel in the room shows; whoever has the panel says. */
  layOut: (view: PanelView) => Layout = () => NO_LAYOUT;
  /** What a change has brought besides what it shows; whoever has the page tells it. */
  onRemark: (text: string) => void = () => undefined;
  private readonly room: Room;
  private readonly picture: Picture;
  private readonly hybrid: Hybrid;
  private pace: Pace;
  private readonly gathering: GatherPace;
  private readonly resting: RestPace;
  private readonly contents: Contents;
  private readonly size: StageSize;
  private readonly disposed = new AbortController();
  private last_ms = 0;
  /** Whether what is looked at, or from where, has changed since the last frame. */
  private isStale = true;
  /** Whether something has come for the picture since the last frame, which may be at rest. */
  private hasCome = false;
  /** Whether the frame before was one of a moving picture, drawn in its budget. */
  private wasMoving = false;
  private waiting: (() => void)[] = [];
  /** In stereo: where the specimen was when it began, in the room and on the screen. */
  private entered: Readonly<{ inRoom: SpecimenPose; onScreen: SpecimenPose | null }> | null = null;

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
    this.renderer = new WebGLRenderer({ antialias: true, powerPreference: "high-performance" });
    this.renderer.info.autoReset = false;
    stage.append(this.renderer.domElement);
    const gl = this.renderer.getContext() as WebGL2RenderingContext;
    this.state = initialState(manifest, gl.getExtension("EXT_color_buffer_float") !== null);
    const canvas = this.renderer.domElement;

    this.room = new Room(manifest);
    this.hybrid = new Hybrid(manifest);
    this.picture = new Picture(this.renderer, this.room, this.hybrid);
    this.pace = new Pace(gl);
    this.gathering = new GatherPace(gl);
    this.resting = new RestPace(gl);
    this.contents = new Contents({
      bundle,
      renderer: this.renderer,
      picture: this.picture,
      state: this.state,
      dispatch: (action) => this.dispatch(action),
      onChange: () => {
        this.hasCome = true;
      },
      onError: (error) => this.report(error),
    });
    const { marks, surfaces, volumes } = this.contents;
    stage.append(...marks.overlayElements);
    this.room.specimen.group.add(surfaces.group, marks.group);

    this.navigation = new Navigation(canvas, place(manifest.specimen.bounds_um), () => {
      this.isStale = true;
    });
    this.stereo = new Stereo(this.renderer, {
      scene: this.room.scene,
      specimen: this.room.specimen,
      tiles: manifest.tiles,
      handles: [marks.target],
      layOut: (view) => this.layOut(view),
      onAction: (action) => this.dispatch(action),
      onCommand: (command) => {
        if (!this.run(command)) this.stereo.tell(CANT);
      },
      onChoose: (ray, tile) => this.choose(ray, tile),
      onStart: () => this.enterStereo(),
      onEnd: () => this.leaveStereo(),
    });
    const rayAt = (point: Vector2) =>
      rayUnder(point, this.navigation.camera, this.room.specimen.group);
    const { signal } = this.disposed;
    listenForHandles(
      stage,
      canvas,
      {
        pick: (point, pointing) =>
          this.stereo.kind === null ? marks.pick(rayAt(point), pointing) : null,
        drag: (id, point) => marks.drag(id, rayAt(point)),
        mean: (id) => marks.mean(id),
      },
      signal,
    );
    listenForClicks(canvas, (point) => {
      if (this.stereo.kind === null) this.tap(rayAt(point));
    });
    const lost = "The graphics driver has dropped the picture: it is drawn anew.";
    canvas.addEventListener("webglcontextlost", () => {
      this.dispatch({ type: "notify", text: lost });
      volumes.forget(); // their texels went with the context
      this.contents.traced.forget();
      this.gathering.forget();
      this.resting.forget();
    });
    canvas.addEventListener("webglcontextrestored", () => {
      volumes.forget(); // those that have come since
      this.contents.traced.forget();
      this.pace = new Pace(gl); // the times that were asked for went, too
      this.follow();
      this.dispatch({ type: "dismiss", text: lost });
    });
    addEventListener("online", () => this.retry(), { signal });
    this.size = new StageSize(stage, () => this.fit());
    this.fit();
    this.follow();
    this.renderer.setAnimationLoop((time_ms) => this.frame(time_ms));
  }

  dispatch(action: Action): void {
    const next = reduce(this.state, action);
    if (next === this.state) return;
    const notice = newNotice(this.state, next);
    const remark = remarkOn(this.state, next, this.bundle.manifest.tiles);
    const before = this.lamps.length;
    this.state = next;
    if (notice !== null) this.stereo.tell(notice);
    if (remark !== null) this.onRemark(remark);
    this.follow();
    if (this.lamps.length > before) this.bringLampsInSight();
    this.onState(next);
  }

  /** Do what is no change of the state; whether this was one of the viewer's commands. */
  run(command: Command): boolean {
    switch (command) {
      case "reset":
        this.dispatch({ type: "isolate", tile: null });
        this.recentre();
        this.navigation.reset();
        break;
      case "back":
        if (this.state.isolated !== null) this.dispatch({ type: "isolate", tile: null });
        else this.dispatch({ type: "select", tile: null });
        break;
      case "retry":
        this.retry();
        break;
      case "press":
        if (this.stereo.kind !== null) return this.stereo.run(command, this.state);
        this.tap(rayAhead(this.head, this.room.specimen.group));
        break;
      default: {
        const isInRoom = this.stereo.kind !== null;
        const isDone = isInRoom
          ? this.stereo.run(command, this.state)
          : this.navigation.run(command);
        if (!isDone) return false;
      }
    }
    this.isStale = true;
    return true;
  }

  /** Lamps may be beside and behind the eye. In stereo the head finds them. */
  private bringLampsInSight(): void {
    if (this.stereo.kind !== null) return;
    const { matrixWorld } = this.room.specimen.group;
    this.navigation.stepBackFor(
      this.lamps.map(({ position }) => new Vector3(...position).applyMatrix4(matrixWorld)),
    );
  }

  /** Those that can be taken hold of. */
  private get lamps(): readonly LampHandle[] {
    return lampHandles(this.state, this.bundle.manifest.specimen.bounds_um);
  }

  /** Light up a handle of the cuts or of the lamps; null: none. */
  mean(handle: HandleId | null): void {
    this.contents.marks.mean(handle);
  }

  /** From where the specimen is seen; null: as it opens. */
  get look(): Look | null {
    const { navigation, poseOnScreen: pose } = this;
    const eye = pose === null ? navigation.look : navigation.lookNow;
    if (eye === null || pose === null) return eye && { ...eye, specimen: null };
    const { position, orientation, scale } = pose;
    const specimen = { position: position.toArray(), orientation: orientation.toArray(), scale };
    return { ...eye, specimen };
  }

  lookFrom({ position, target, specimen }: Look): void {
    this.navigation.lookFrom({ position, target });
    if (specimen !== null) {
      const pose = {
        position: new Vector3(...specimen.position),
        orientation: new Quaternion(...specimen.orientation),
        scale: specimen.scale,
      };
      this.room.specimen.moveTo(pose, this.navigation.camera.position);
    }
    this.isStale = true;
  }

  snapshot(): Snapshot {
    const { surfaces, volumes } = this.contents;
    return {
      state: this.state,
      hasFirstPicture: surfaces.hasFirst,
      overview: surfaces.overview,
      isLoading: this.contents.isLoading,
      triangles: surfaces.triangles,
      volumes: volumes.status(),
      volumeBytes: volumes.bytes,
      traced: this.contents.traced.status(),
      gazed: this.hybrid.nearby.gazed,
      discRadius_deg: (this.hybrid.outer_rad * 180) / Math.PI,
      frame_ms: this.pace.frame_ms,
      settings: this.pace.settings,
      measuredValues: this.contents.marks.values,
      gpuObjects: {
        ...this.renderer.info.memory,
        programs: this.renderer.info.programs?.length ?? 0,
      },
      isStereo: this.stereo.kind !== null,
      told: this.stereo.hands.notice.texts,
    };
  }

  /** Resolves when nothing loads any more and the picture shows all of it. */
  settled(): Promise<void> {
    this.isStale = true;
    return new Promise((resolve) => this.waiting.push(resolve));
  }

  report(error: unknown): void {
    if (!(error instanceof BundleError)) throw error;
    const isMendable = error instanceof TemporaryError;
    const text = isMendable ? error.notice : error.message;
    // for each of a host's files it would be told anew
    if (isMendable && this.state.mendable.includes(text)) return;
    this.dispatch({ type: "notify", text, isMendable });
  }

  /** Light the traced picture by a file of the user's. Throws BundleError. */
  async lightBy(file: File): Promise<void> {
    await this.contents.traced.lightBy(file);
    this.dispatch({ type: "trace", change: { environment: "own" } });
  }

  /** Voxels of a channel by value and gradient; null: not yet, it is being fetched. */
  histogram(channel: string): Histogram | null {
    return this.contents.planes.histogram(channel);
  }

  /** Ask again for all that has failed. */
  private retry(): void {
    for (const text of this.state.mendable) this.dispatch({ type: "dismiss", text });
    this.contents.retryFailed();
    this.follow();
  }

  /** Must be called from a tap. Throws BundleError in words if the browser or the user refuses. */
  async startSplit(profile: Profile): Promise<void> {
    const problems = await this.stereo.startSplit(profile);
    for (const text of problems) this.dispatch({ type: "notify", text });
  }

  private follow(): void {
    const { isolated, selected, quality } = this.state;
    const { manifest } = this.bundle;
    this.room.specimen.show(isolated === null ? null : shownBox(manifest, isolated));
    this.contents.follow(this.state, this.hybrid);
    this.room.mark(isolated === null ? selected : null);
    this.pace.setLevel(quality);
    this.isStale = true;
  }

  private frame(time_ms: number): void {
    if (this.renderer.getContext().isContextLost()) return; // there is nothing to draw on
    const interval_ms = time_ms - this.last_ms;
    const dt_s = Math.min(LONGEST_FRAME_S, Math.max(0, interval_ms / 1000));
    this.last_ms = time_ms;
    const wasLoading = this.contents.isLoading;
    if (this.contents.hasJustBegun()) this.follow();
    const inRoom = this.stereo.pose(this.picture.eyes);
    const isStereo = inRoom !== null;
    const { contents } = this;
    const camera = inRoom ?? this.poseMono(Math.max(0, interval_ms) / 1000);
    if (isStereo) this.stereo.hands.update(dt_s, this.head, this.state);
    const { isChanging, isFading } = this.advance(dt_s);
    const isGathering = contents.traced.isGathering && this.gathering.isReady(time_ms);
    const isDue = this.resting.isDue(time_ms) && this.hasCome;
    const isMoving = isStereo || this.isStale;
    // a picture that came to rest is drawn once more, as well as can be
    const isWanted = isMoving || this.wasMoving || isGathering || isDue;
    if (!isWanted && !wasLoading && !this.hasCome) return;
    const settings = this.pace.begin(isMoving, interval_ms, this.stereo.headset.rate_hz);
    this.picture.marchFrame.uSteps.value = settings.steps;
    this.hybrid.radiusShare = settings.discShare;
    const [eye] = this.picture.eyes.all; // a headset has none before its first pose
    if (eye !== undefined) {
      const { z, w } = eye.viewport;
      this.contents.stream(
        this.stereo.seenBy(camera),
        z,
        w,
        ERROR_TARGET_PX * settings.errorFactor,
      );
    }
    if (isWanted) {
      this.isStale = isChanging;
      this.hasCome = isFading;
      contents.surfaces.dressAll();
      const { passes } = this.gathering;
      this.draw(camera, { resolution: settings.resolution, isMoving, passes });
      if (isGathering) this.gathering.submit(time_ms);
      if (!isMoving) this.resting.submit(time_ms);
      this.frames++;
      this.onFrame();
    }
    this.pace.end();
    this.wasMoving = isMoving;
    const isAtRest = isStereo || (!isMoving && !this.hasCome);
    if (this.waiting.length > 0 && !this.contents.isLoading && !this.isStale && isAtRest) {
      for (const resolve of this.waiting.splice(0)) resolve();
    }
  }

  private poseMono(dt_s: number): Camera {
    this.navigation.update(dt_s);
    this.picture.eyes.followScreen(this.renderer, this.navigation.camera);
    return this.navigation.camera;
  }

  /** Follow the gaze, and go on with what moves and with what fades; whether it goes on. */
  private advance(dt_s: number): Readonly<{ isChanging: boolean; isFading: boolean }> {
    const { hybrid, contents, head, navigation, stage, state } = this;
    const { specimen } = this.room;
    const { group } = specimen;
    const isMoving = specimen.advance(dt_s);
    const isReady = (tile: string) => contents.volumes.isReady(tile);
    if (hybrid.look(state, head, group.matrixWorld, isReady, dt_s)) this.follow();
    const screen = {
      camera: navigation.camera,
      height_px: stage.clientHeight,
      focus: navigation.controls.target,
    };
    const isFading = contents.advance({
      head,
      specimen: group.matrixWorld,
      screen: this.stereo.kind === null ? screen : null,
      gaze: rayAhead(head, group),
      disc: { apex_um: hybrid.apex_um, axis_um: hybrid.axis_um, cosine: hybrid.cosines[1] },
      isPanelOpen: this.stereo.hands.panel.isOpen,
      dt_s,
    });
    const isChanging = isMoving || hybrid.isChanging(state);
    if (isChanging) this.isStale = true;
    if (isFading) this.hasCome = true;
    return { isChanging, isFading };
  }

  private draw(camera: Camera, pace: FramePace): void {
    const { contents, stereo, head, picture } = this;
    const { volumes, traced, surfaces, marks } = contents;
    const drawn = {
      volumes,
      traced,
      panes: surfaces.blended,
      overlays: [...marks.overlays, ...stereo.hands.overlays],
      bounds: this.bundle.manifest.specimen.bounds_um,
      solids: surfaces.triangles,
    };
    stereo.present(() => picture.draw(camera, head, drawn, this.state.clip, pace));
  }

  /** Pose of the head, or of the mono camera. */
  private get head(): Matrix4 {
    return this.stereo.head ?? this.navigation.camera.matrixWorld;
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

  /** The specimen where it opens: in stereo straight before the head, at its height. */
  private recentre(): void {
    const { specimen } = this.room;
    const head = this.stereo.recentre();
    if (head === null) specimen.goHome();
    else specimen.anchorAt(ahead(head, XR_DISTANCE_M));
  }

  /** The specimen turns the same side to the head as to the screen, what was looked at ahead. */
  private enterStereo(): void {
    const { navigation, room } = this;
    const { specimen } = room;
    navigation.controls.enabled = false;
    const ahead_m = new Vector3(0, 0, -XR_DISTANCE_M);
    const onScreen = this.poseOnScreen;
    const pose = intoRoom(specimen.pose, this.screenHold, ahead_m);
    specimen.anchorAt(ahead_m);
    if (navigation.look !== null || onScreen !== null) specimen.moveTo(pose, new Vector3());
    this.entered = { inRoom: specimen.pose, onScreen };
    this.onState(this.state);
  }

  /** What was looked at stays. */
  private leaveStereo(): void {
    const { navigation, poseOnScreen: pose } = this;
    const { specimen } = this.room;
    this.entered = null;
    navigation.controls.enabled = true;
    specimen.anchorAt(new Vector3());
    if (pose !== null) specimen.moveTo(pose, navigation.camera.position);
    this.fit();
    this.onState(this.state);
  }

  /** The flat camera, held as a hand holds a thing: by the point that it is turned about. */
  private get screenHold(): HandPose {
    const { target, object } = this.navigation.controls;
    return { position: target, orientation: object.quaternion };
  }

  /** Where the specimen is to the flat camera, also while there is stereo; null: where it opens. */
  private get poseOnScreen(): SpecimenPose | null {
    const { entered, navigation } = this;
    const { anchor, home, isMoved, pose } = this.room.specimen;
    if (entered === null) return isMoved ? pose : null;
    if (pose === entered.inRoom) return entered.onScreen; // nobody has moved it there
    if (!isMoved && navigation.look === null) return null;
    return ontoScreen(isMoved ? pose : home, this.screenHold, anchor);
  }

  private tap(ray: Ray): void {
    const tiles = shownTiles(this.bundle.manifest.tiles, this.state.isolated);
    this.choose(ray, pickTile(ray, tiles, this.state.clip)?.id ?? null);
  }

  /** Measure, or choose the tile; of one that is alone nothing is left to choose. */
  private choose(ray: Ray, tile: string | null): void {
    const { state } = this;
    if (state.tool === "measure") void this.contents.marks.measure(ray);
    else if (state.isolated === null && tile !== null) this.dispatch(chosenTile(state, tile));
  }

  dispose(): void {
    this.renderer.setAnimationLoop(null);
    this.size.dispose();
    this.disposed.abort();
    this.stereo.dispose();
    this.navigation.dispose();
    this.contents.dispose();
    this.picture.dispose();
    this.pace.dispose();
    this.renderer.dispose();
    this.renderer.domElement.remove();
  }
}
