/**
 * Stereo of all kinds: a headset's session, a phone's split screen, or two images on the page's
 * screen.
 */
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
  /** Factor to the distance between the eyes; 0 shows both eyes the same image. */
  strength: number;
  /** CSS pixels per inch of the screen; null: estimated from the browser's name. */
  cssPixelsPerInch: number | null;
}>;

export class Stereo {
  readonly headset: XrSession;
  /** Gaze, hands and the headset panel; null until stereo is first prepared. */
  hands: Hands | null = null;
  private loading: Promise<Hands> | null = null;
  /** The choices on the page, passed to the headset panel when it is loaded. */
  private choices: Partial<PanelView> = {};
  private readonly split: LaterSplit;
  readonly screen: LaterScreen;
  private eyes: EyeSettings = { distance_m: 0.063, strength: 1, cssPixelsPerInch: null };
  private readonly between = new Matrix4();
  /** True in augmented reality before the first frame that has a head pose. */
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
        // in the user's own room, the position of the head is known only from the first frame on
        if (this.headset.isInUsersRoom) this.isArriving = true;
        else this.begin(this.headset.current);
      },
      () => this.leave(),
    );
  }

  /**
   * Loads the code that draws stereo and handles input. Rejects with BundleError; may be called
   * again.
   */
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

  /**
   * Passes to the headset panel what the user has chosen in the panel of the page, such as open
   * sections.
   */
  showInPanel(choices: Partial<PanelView>): void {
    this.choices = { ...this.choices, ...choices };
    this.hands?.panel.take(choices);
  }

  /** Must be called from a click or a tap. Rejects if the browser or the user refuses. */
  startHeadset(xr: XRSystem, mode: ImmersiveMode = "immersive-vr"): Promise<void> {
    return this.headset.start(xr, mode, this.prepare());
  }

  /**
   * Places the eyes in front of the page's screen, looking at `focus`: two if the screen shows
   * stereo, otherwise one.
   */
  followScreen(eyes: Eyes, camera: PerspectiveCamera, focus: Vector3): void {
    this.screen.sync(eyes, camera, focus, this.eyes.distance_m * this.eyes.strength);
  }

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
   * Splits the screen for a phone in a Cardboard viewer, without WebXR. Must be called from a tap.
   * Throws BundleError if the browser or the user refuses. Returns a message for each missing
   * feature.
   */
  startSplit(profile: Profile): Promise<readonly string[]> {
    if (this.kind !== null) return Promise.resolve([]);
    return this.split.start(profile);
  }

  /** Objects that are not part of the specimen, which the depth pass leaves out. */
  get overlays(): readonly Object3D[] {
    return this.hands?.overlays ?? [];
  }

  /** Places the eyes for this frame. Returns the camera to draw with; null without stereo. */
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
    eyes.sync(running.eyes.map(({ camera, viewport }) => [camera, viewport]));
    return running.camera;
  }

  /** Whether the user's own room is visible behind the specimen. */
  get isInUsersRoom(): boolean {
    return this.headset.isInUsersRoom;
  }

  /** The camera whose view contains both eyes' views. */
  seenBy(camera: Camera): Camera {
    // three.js moves the headset's own cameras, not the one passed to it
    return this.renderer.xr.isPresenting ? this.renderer.xr.getCamera() : camera;
  }

  /** Pose of the point between the eyes in the scene; null without stereo. */
  get head(): Matrix4 | null {
    if (this.renderer.xr.isPresenting) {
      return betweenEyes(this.renderer.xr.getCamera().cameras, this.between);
    }
    return this.split.running?.head ?? null;
  }

  /**
   * Makes the direction in which the head looks now the direction ahead. Returns the head's new
   * pose; null without stereo.
   */
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

  /** Draws a frame, distorted for the lenses if the screen is split. */
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

  /** Changes the lens profile; has an effect only on a split screen. */
  setLenses(profile: Profile): void {
    this.split.setProfile(profile);
  }

  /** Scales the specimen about its middle; has no effect on a flat screen. */
  resize(factor: number, state: ViewerState): void {
    if (this.kind !== null) this.hands?.resize(factor, state);
  }

  /** Applies a command that moves the specimen in stereo. Returns false for other commands. */
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

  /** Updates input for one frame of stereo, before drawing; see `Hands.update`. */
  update(dt_s: number, head: Matrix4, state: ViewerState, read_s: number): void {
    this.hands?.update(dt_s, head, state, read_s);
  }

  get notices(): readonly string[] {
    return this.hands?.notice.texts ?? [];
  }

  /** Shows a notice in stereo; has no effect on a flat screen. */
  announce(text: string): void {
    this.hands?.announce(text);
  }

  get isPanelOpen(): boolean {
    return this.hands?.panel.isOpen ?? false;
  }

  get menu(): readonly MenuEntry[] {
    const { head, hands } = this;
    if (head === null || hands === null) return [];
    return hands.menuFrom(head);
  }

  /** Opens or closes the headset panel. Returns false without stereo. */
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
