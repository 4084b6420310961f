/** Stereo, whichever way: a headset's session, or a split screen in a phone's viewer. */
import {
  type Camera,
  Matrix4,
  type Object3D,
  type PerspectiveCamera,
  type Vector3,
  type WebGLRenderer,
} from "three";
import type { Eyes } from "../gpu/eyes";
import type { PanelView } from "../panel/controls";
import type { Command } from "../state/commands";
import type { ViewerState } from "../state/viewer_state";
import type { Gesture } from "./cardboard/fingers";
import { LaterSplit } from "./cardboard/later_split";
import type { Profile } from "./cardboard/viewer_profile";
import type { HandsOptions } from "./hands_options";
import { betweenEyes } from "./head_pose";
import type { Hands } from "./interaction";
import type { MenuEntry } from "./panel/menu_entries";
import { LaterScreen, notLoaded } from "./screen/later_screen";
import { type ImmersiveMode, XrSession } from "./session";
import { spreadEyes } from "./stereo_strength";

export type StereoOptions = Omit<HandsOptions, "xr" | "onLeave"> &
  Readonly<{ onStart: () => void; onEnd: () => void }>;

export type EyeSettings = Readonly<{
  distance_m: number;
  /** Factor to it. */
  strength: number;
  /** CSS pixels in an inch of the screen; null: guessed from the browser's name. */
  cssPixelsPerInch: number | null;
}>;

export class Stereo {
  readonly headset: XrSession;
  /** Gaze, hands and the panel in the room; null until stereo is first wanted. */
  hands: Hands | null = null;
  private loading: Promise<Hands> | null = null;
  /** The page's own choices, for the panel in the room as soon as it is loaded. */
  private choices: Partial<PanelView> = {};
  private readonly split: LaterSplit;
  /** Stereo on the page's own screen. */
  readonly screen: LaterScreen;
  private eyes: EyeSettings = { distance_m: 0.063, strength: 1, cssPixelsPerInch: null };
  private readonly between = new Matrix4();
  /** In the user's own room, before the first frame with a head. */
  private isArriving = false;

  constructor(
    private readonly renderer: WebGLRenderer,
    private readonly options: StereoOptions,
  ) {
    this.screen = new LaterScreen(renderer);
    const handlers = {
      prepare: () => this.prepare(),
      onStart: () => this.begin(null),
      onEnd: () => this.leave(),
      onGesture: (gesture: Gesture) => this.hands?.touch(gesture),
    };
    this.split = new LaterSplit(renderer, handlers, this.splitOptions);
    this.headset = new XrSession(
      renderer,
      () => {
        // where the head is in the user's own room the first frame tells
        if (this.headset.isInUsersRoom) this.isArriving = true;
        else this.begin(this.headset.current);
      },
      () => this.leave(),
    );
  }

  /** Load what stereo draws and listens with. Rejects with a BundleError, and may be asked again. */
  prepare(): Promise<Hands> {
    this.loading ??= import("./interaction")
      .then(({ Hands }) => {
        const { renderer, options } = this;
        const hands = new Hands({ ...options, xr: renderer.xr, onLeave: () => this.end() });
        hands.panel.take(this.choices);
        this.hands = hands;
        return hands;
      })
      .catch((error) => {
        this.loading = null;
        return notLoaded(error);
      });
    return this.loading;
  }

  /** What the user has chosen on the page, and the panel in the room shows as well. */
  showInPanel(choices: Partial<PanelView>): void {
    this.choices = { ...this.choices, ...choices };
    this.hands?.panel.take(choices);
  }

  /** Must be called from a click or a tap. Rejects if the browser or the user refuses. */
  startHeadset(xr: XRSystem, mode: ImmersiveMode = "immersive-vr"): Promise<void> {
    return this.headset.start(xr, mode, this.prepare());
  }

  /** The eyes before the page's own screen, which look at `focus`: two, where it shows stereo. */
  followScreen(eyes: Eyes, camera: PerspectiveCamera, focus: Vector3): void {
    this.screen.follow(eyes, camera, focus, this.eyes.distance_m * this.eyes.strength);
  }

  /** What the user has set for the eyes. */
  setEyes(eyes: EyeSettings): void {
    const isSame = JSON.stringify(eyes) === JSON.stringify(this.eyes);
    this.eyes = eyes;
    if (!isSame) this.split.set(this.splitOptions);
  }

  private get splitOptions() {
    const { distance_m, strength, cssPixelsPerInch } = this.eyes;
    return { cssPixelsPerInch, apart_m: distance_m * strength };
  }

  get kind(): "headset" | "split" | null {
    if (this.renderer.xr.isPresenting) return "headset";
    return this.split.running === null ? null : "split";
  }

  /**
   * Split screen for a phone in a viewer without WebXR. Must be called from a tap. Throws
   * BundleError in words if the browser or the user refuses. Returns what could not be had.
   */
  startSplit(profile: Profile): Promise<readonly string[]> {
    if (this.kind !== null) return Promise.resolve([]);
    return this.split.start(profile);
  }

  /** Everything but what is opaque, which the pass for the depth has to leave out. */
  get overlays(): readonly Object3D[] {
    return this.hands?.overlays ?? [];
  }

  /** Where the eyes are in this frame. Returns the camera to draw with; null: no stereo. */
  pose(eyes: Eyes): Camera | null {
    if (this.renderer.xr.isPresenting) {
      spreadEyes(this.renderer.xr.getCamera().cameras, this.eyes.strength);
      eyes.followHeadset(this.renderer, this.headset.camera);
      if (this.isArriving && eyes.all.length > 0) {
        this.isArriving = false;
        this.begin(this.headset.current);
      }
      return this.headset.camera;
    }
    const { running } = this.split;
    if (running === null) return null;
    running.update();
    eyes.follow(running.eyes.map(({ camera, viewport }) => [camera, viewport]));
    return running.camera;
  }

  /** Whether the user's own room shows behind the specimen. */
  get isInUsersRoom(): boolean {
    return this.headset.isInUsersRoom;
  }

  /** The camera that sees what both eyes see. */
  seenBy(camera: Camera): Camera {
    // three moves the headset's cameras, not the one that it is given
    return this.renderer.xr.isPresenting ? this.renderer.xr.getCamera() : camera;
  }

  /** Pose of the head in the room, between the eyes; null: no stereo. */
  get head(): Matrix4 | null {
    if (this.renderer.xr.isPresenting) {
      return betweenEyes(this.renderer.xr.getCamera().cameras, this.between);
    }
    return this.split.running?.head ?? null;
  }

  /** Take what the head looks at for ahead. Returns its pose then; null: no stereo. */
  recentre(): Matrix4 | null {
    const { running } = this.split;
    if (running !== null) {
      const before = running.head.clone();
      running.recentre();
      running.update();
      this.hands?.panel.keepPlace(before, running.head);
    }
    return this.head;
  }

  /** Draw a frame: through the lenses, where the screen is split. */
  present(draw: () => void): void {
    const { running } = this.split;
    if (running === null) {
      if (this.kind === null) this.screen.present(draw);
      else draw();
      return;
    }
    this.renderer.setRenderTarget(running.target);
    draw();
    this.renderer.setRenderTarget(null);
    running.present();
  }

  /** The phone is in another viewer; nothing changes where there is no split screen. */
  setLenses(profile: Profile): void {
    this.split.setProfile(profile);
  }

  /** The specimen becomes so much larger where it is; on a flat screen nothing does. */
  resize(factor: number, state: ViewerState): void {
    if (this.kind !== null) this.hands?.resize(factor, state);
  }

  /** Whether a command was one of those that move the specimen before the eyes. */
  run(command: Command, state: ViewerState): boolean {
    const { hands } = this;
    if (command !== "press") return hands?.run(command, state) ?? false;
    hands?.tap();
    return true;
  }

  end(): void {
    this.split.end();
    void this.headset.end();
  }

  /** Once a frame of stereo, before it is drawn; see `Hands.update`. */
  update(dt_s: number, head: Matrix4, state: ViewerState, read_s: number): void {
    this.hands?.update(dt_s, head, state, read_s);
  }

  /** The notices before the eyes now. */
  get notices(): readonly string[] {
    return this.hands?.notice.texts ?? [];
  }

  /** Say something before the eyes; nothing where there is no stereo. */
  announce(text: string): void {
    this.hands?.announce(text);
  }

  /** Whether the panel in the room is open. */
  get isPanelOpen(): boolean {
    return this.hands?.panel.isOpen ?? false;
  }

  /** What the panel in the room has now, and its button. */
  get menu(): readonly MenuEntry[] {
    const { head, hands } = this;
    if (head === null || hands === null) return [];
    return hands.menuFrom(head);
  }

  /** Open or close the panel in the room; false: no stereo. */
  togglePanel(): boolean {
    if (this.kind === null) return false;
    this.hands?.panel.toggle();
    return true;
  }

  private begin(session: XRSession | null): void {
    const { hands } = this;
    if (hands === null) throw new Error("stereo began before its part of the page was loaded");
    const isInHand = session?.interactionMode === "screen-space";
    const onTable = isInHand ? "in-hand" : "over-table";
    this.options.onStart();
    hands.enter(session, this.isInUsersRoom ? onTable : "before-eyes");
  }

  private leave(): void {
    this.isArriving = false;
    this.hands?.stop();
    this.options.onEnd();
  }

  dispose(): void {
    this.hands?.dispose();
    this.split.dispose();
    this.screen.dispose();
  }
}
