/**
 * Handles all input in stereo: looking, pointing, pressing and holding. The same class serves WebXR
 * and the split screen, which has only the gaze and a tap.
 */
import { Matrix4 } from "three";
import type { Ring } from "../interaction/dwell_ring";
import {
  firstHit,
  gazeOf,
  Pointer,
  type SceneRay,
  type Target,
  type TargetHit,
} from "../interaction/ray_pointer";
import { TileTarget } from "../interaction/tile_target";
import { shownTiles } from "../math/pick";
import type { Command } from "../state/commands";
import { DWELL } from "../state/parameters/tools";
import type { ViewerState } from "../state/viewer_state";
import type { Gesture } from "./cardboard/fingers";
import { GazeCarry } from "./carry_handle";
import { Controllers } from "./controllers";
import { Grips, type TimedGesture } from "./grips";
import { Ground } from "./ground";
import type { HandsOptions } from "./hands_options";
import { type HeadHold, moveByGaze } from "./hold_specimen";
import { howItWorks, isIntroductionDue } from "./how_it_works";
import { LastChoice } from "./last_choice";
import { type MenuEntry, menuEntries } from "./panel/menu_entries";
import { StereoNotice } from "./panel/notice";
import { HeadsetPanel } from "./panel/panel";
import { PANEL } from "./panel/panel_surface";
import type { Setting } from "./panel/placement";
import { PointedLight } from "./pointed_light";
import { SpecimenMover } from "./specimen_mover";

/**
 * The switch for choosing by gaze. The gaze cannot switch it off, because it could not switch it on
 * again.
 */
const GAZE_SWITCH = `${PANEL}${DWELL.id}`;
const KEEPS_GAZE = "Switch this off with a button: the gaze could not switch it on again.";

const CARRY = "The specimen moves with your gaze. Rest your gaze to put it down.";
const UNDO = `${PANEL}undo-choice`;
/** The bar's button with which the gaze picks up the specimen. */
const CARRY_BUTTON = `${PANEL}bar-move`;

export class Hands {
  readonly panel: HeadsetPanel;
  private readonly light: PointedLight;
  readonly notice: StereoNotice;
  readonly ground = new Ground();
  private readonly mover: SpecimenMover;
  private readonly controllers = new Controllers();
  private readonly pointer = new Pointer();
  readonly tiles: TileTarget;
  private readonly targets: readonly Target[];
  private readonly carry = new GazeCarry();
  private readonly grips: Grips;
  private gestures: TimedGesture[] = [];
  private gaze: SceneRay = gazeOf(new Matrix4());
  /** Times of the button presses since the last frame, ms. */
  private taps: number[] = [];
  private isRunning = false;
  private readonly lastChoice = new LastChoice();
  /** Pose and gaze at the moment when the bar's button picked up the specimen. */
  private barHold: HeadHold | null = null;
  private state: ViewerState | null = null;

  constructor(private readonly options: HandsOptions) {
    const { scene, specimen, handles = () => [], buildPanel, onLeave } = options;
    const { onLenses = () => undefined, isPainted = true } = options;
    this.mover = new SpecimenMover(specimen, options.tiles);
    this.notice = new StereoNotice(isPainted);
    this.panel = new HeadsetPanel({
      buildPanel,
      onLeave,
      onLenses,
      isPainted,
      onAnnounce: (text) => this.announce(text),
      onUndo: () => this.undo(),
      onCarry: (ray, isStart) => this.carrySpecimen(ray, isStart),
      onRequest: (request) => {
        if (typeof request === "string") options.onCommand(request);
        else options.onAction(request);
      },
    });
    this.tiles = new TileTarget(specimen.group, options.onChoose, options.objectAlong);
    this.grips = new Grips({
      ...{ controllers: this.controllers, pointer: this.pointer },
      ...{ mover: this.mover, tiles: this.tiles },
      aim: () => ({ gaze: this.gaze, choosable: this.choosable }),
      run: (command, state, share) => this.run(command, state, share),
      onPress: (ray, time_ms) => this.press(ray, time_ms),
      onTap: (time_ms) => this.tap(time_ms),
    });
    const { pointer, controllers, grips, panel } = this;
    this.light = new PointedLight({ pointer, controllers, grips, panel });
    this.targets = [...this.panel.targets, ...handles(), this.tiles];
    scene.add(...this.overlays);
  }

  /** Objects that are not part of the specimen, which the depth pass leaves out. */
  get overlays() {
    const { controllers, panel, ring, notice, ground } = this;
    return [controllers.group, panel.group, ring.group, notice.mesh, ground.lines];
  }

  get ring(): Ring {
    return this.light.ring;
  }

  /**
   * Key of the target that is pointed at now, for tests and for names under the gaze: `tile:r0_c1`,
   * `panel:mode=disc`.
   */
  get pointed(): string | null {
    return this.pointer.leading?.key ?? null;
  }

  get progress(): number {
    return this.pointer.progress;
  }

  /** Whether the gaze carries a handle or the specimen. */
  get isCarrying(): boolean {
    return this.carry.isCarrying;
  }

  /**
   * Whether the gaze or the head carries something of the scene and not a part of the open menu.
   */
  private get isCarryingInScene(): boolean {
    const { key } = this.carry;
    const isOfMenu = key?.startsWith(PANEL) === true && key !== CARRY_BUTTON;
    return this.grips.headHold !== null || (key !== null && !isOfMenu);
  }

  /**
   * Starts input, and shows the introduction.
   * @param session null: split screen, without controllers
   */
  enter(session: XRSession | null, setting: Setting): void {
    this.panel.setting = setting;
    this.start(session);
    this.ground.show(setting === "before-eyes");
    if (isIntroductionDue()) this.announce(howItWorks(setting));
  }

  menuFrom(head: Matrix4): readonly MenuEntry[] {
    return menuEntries(this.panel.places, head);
  }

  /** Starts input as `enter` does, but without the introduction. */
  start(session: XRSession | null): void {
    this.stop();
    this.isRunning = true;
    this.panel.setShown(true);
    if (session !== null) this.controllers.begin(session, this.options.xr.getReferenceSpace());
  }

  stop(): void {
    this.isRunning = false;
    this.controllers.end();
    this.pointer.reset();
    this.carry.drop();
    this.grips.drop();
    this.taps = [];
    this.gestures = [];
    this.lastChoice.take();
    this.panel.setShown(false);
    this.notice.clear();
    this.ring.hide();
    this.ground.show(false);
  }

  /**
   * Presses the only button of the split screen, or the key that stands for it.
   * @param time_ms time of the press, on the clock of DOM events
   */
  tap(time_ms = this.now_ms()): void {
    this.taps.push(time_ms);
  }

  touch(gesture: Gesture, time_ms = this.now_ms()): void {
    this.gestures.push([gesture, time_ms]);
  }

  /** Shows a notice where the head looks. */
  announce(text: string): void {
    if (this.isRunning) this.notice.announce(text);
  }

  /**
   * Applies a camera command of a flat screen to the specimen, by a share of a step. Returns false
   * if the command is not one of these.
   */
  run(command: Command, state: ViewerState, share = 1): boolean {
    return this.mover.run(command, state, this.gaze.origin, share);
  }

  /** Scales the specimen by a factor about its middle. */
  resize(factor: number, state: ViewerState): void {
    this.mover.resize(factor, state, this.gaze.origin);
  }

  /**
   * Updates everything for one frame. Call it before drawing. Returns whether the image differs
   * from the last one.
   *
   * @param read_s seconds for which notices could be read; in a slow frame more than `dt_s`, which
   *   limits motion
   */
  update(dt_s: number, head: Matrix4, state: ViewerState, read_s = dt_s): boolean {
    if (!this.isRunning) return false;
    const { xr } = this.options;
    this.gaze = gazeOf(head);
    this.state = state;
    this.tiles.tiles = shownTiles(this.options.tiles, state.isolated);
    this.tiles.sync(state);
    this.controllers.update(xr.getFrame() ?? null, xr.getReferenceSpace());
    for (const event of this.controllers.take()) this.grips.handle(event);
    const hasTouched = this.grips.followFingers(this.gestures.splice(0), state);
    for (const time_ms of this.taps.splice(0)) this.press(this.gaze, time_ms);
    this.grips.forgetLostSources();
    const hasHeld = this.grips.hold(dt_s);
    const hasFollowed = this.grips.followHead(dt_s, state);
    const hasMoved = this.grips.moveBySticks(dt_s, state) || hasHeld || hasTouched || hasFollowed;
    const isRepeating = this.grips.isRepeating || this.carry.isCarrying;
    const now = { state, pose: this.mover.pose };
    const isLookedAt = this.pointer.gaze?.key === UNDO;
    this.panel.canUndo = this.lastChoice.advance(dt_s, now, isRepeating, isLookedAt);
    this.panel.isCarrying = this.isCarryingInScene;
    const isRepainted = this.panel.update(dt_s, head, state);
    const isNoticeNew = this.notice.update(read_s, head, this.panel.upperEdge);
    const rays = this.carry.isCarrying ? [] : this.grips.tracked.map(({ ray }) => ray);
    const fired = this.pointer.advance(this.gaze, rays, this.choosable, dt_s, state.isDwellOn);
    if (fired?.key === GAZE_SWITCH && state.isDwellOn) this.announce(KEEPS_GAZE);
    else if (fired !== null) {
      this.choose(fired, this.now_ms(), true);
      this.grips.startRepeating(fired);
    }
    const hasRepeated = this.grips.repeat(dt_s, state);
    const hasCarried = this.carry.follow(this.gaze);
    return (
      this.light.draw(head) || hasMoved || isRepainted || isNoticeNew || hasRepeated || hasCarried
    );
  }

  dispose(): void {
    this.stop();
    const { scene } = this.options;
    scene.remove(...this.overlays);
    this.panel.dispose();
    this.notice.dispose();
    this.controllers.dispose();
    this.light.dispose();
    this.ground.dispose();
  }

  private now_ms(): number {
    return (this.options.now_ms ?? (() => performance.now()))();
  }

  /** Targets that can be chosen now. A carried object covers all others until it is put down. */
  private get choosable(): readonly Target[] {
    // Nothing can be chosen while the head carries the specimen.
    if (this.grips.headHold !== null) return [];
    return this.carry.isCarrying ? [this.carry] : this.targets;
  }

  /** Chooses the target on the ray of the button, or else the one under the gaze. */
  private press(ray: SceneRay, time_ms: number): void {
    const hit = firstHit(ray, this.choosable) ?? firstHit(this.gaze, this.choosable);
    if (hit !== null) this.choose(hit, time_ms);
  }

  private choose(hit: TargetHit, time_ms: number, isByGaze = false): void {
    if (hit.key === null) return;
    const counts = this.pointer.press(hit, this.choosable, time_ms);
    if (!counts && !isByGaze) return;
    const { pose } = this.mover;
    if (hit.key !== UNDO && this.state) this.lastChoice.remember({ state: this.state, pose });
    hit.target.choose(hit, hit.ray, isByGaze);
    if (hit.hold === "carry" && hit.ray === this.gaze) this.carry.take(hit);
  }

  private undo(): void {
    const before = this.lastChoice.take();
    if (before === null) return;
    this.options.onAction({ type: "restore", state: before.state });
    this.mover.jumpTo(before.pose, this.gaze.origin);
  }

  /** Picks up the specimen after the bar's button, then moves it with the gaze until the gaze rests. */
  private carrySpecimen(gaze: SceneRay, isStart: boolean): void {
    if (isStart && this.state !== null) {
      this.barHold = this.mover.holdBy(gaze, this.state);
      this.announce(CARRY);
    } else if (this.barHold !== null) {
      this.mover.moveTo(moveByGaze(this.barHold, gaze), gaze.origin);
    }
  }
}
