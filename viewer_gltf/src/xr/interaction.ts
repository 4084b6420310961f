/**
 * Everything that is done in stereo: looking, pointing, pressing, holding. One of it serves both
 * WebXR and the split screen, where there is nothing but the gaze and a tap.
 */
import { Matrix4 } from "three";
import type { Ring } from "../interaction/dwell_ring";
import {
  gazeOf,
  type Met,
  meetFirst,
  Pointer,
  type RoomRay,
  type Target,
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
import { howItWorks, isToBeTold } from "./how_it_works";
import { LastChoice } from "./last_choice";
import { type MenuEntry, menuEntries } from "./panel/menu_entries";
import { RoomNotice } from "./panel/notice";
import { RoomPanel } from "./panel/panel";
import { PANEL } from "./panel/panel_surface";
import type { Setting } from "./panel/placement";
import { PointedLight } from "./pointed_light";
import { SpecimenMover } from "./specimen_mover";

/** By gaze alone it is not switched off: nothing would be left to switch it on by. */
const GAZE_SWITCH = `${PANEL}${DWELL.id}`;
const KEEPS_GAZE = "Switch this off by the button: where there is none, the gaze is all there is.";

const CARRY = "It moves with your gaze. Rest to put it down.";
/** The bar's button that undoes the last choice. */
const UNDO = `${PANEL}undo-choice`;
/** The bar's button by which the gaze takes the specimen. */
const CARRY_BUTTON = `${PANEL}bar-move`;

export class Hands {
  readonly panel: RoomPanel;
  private readonly light: PointedLight;
  readonly notice: RoomNotice;
  readonly ground = new Ground();
  private readonly mover: SpecimenMover;
  private readonly controllers = new Controllers();
  private readonly pointer = new Pointer();
  readonly tiles: TileTarget;
  private readonly targets: readonly Target[];
  private readonly carry = new GazeCarry();
  private readonly grips: Grips;
  private gestures: TimedGesture[] = [];
  private gaze: RoomRay = gazeOf(new Matrix4());
  /** Times at which the button was pressed since the previous frame, ms. */
  private taps: number[] = [];
  private isRunning = false;
  private readonly lastChoice = new LastChoice();
  /** The specimen as it was taken by the bar. */
  private barHold: HeadHold | null = null;
  private state: ViewerState | null = null;

  constructor(private readonly options: HandsOptions) {
    const { scene, specimen, handles = () => [], buildPanel, onLeave } = options;
    const { onLenses = () => undefined, isPainted = true } = options;
    this.mover = new SpecimenMover(specimen, options.tiles);
    this.notice = new RoomNotice(isPainted);
    this.panel = new RoomPanel({
      buildPanel,
      onLeave,
      onLenses,
      isPainted,
      onAnnounce: (text) => this.announce(text),
      onUndo: () => this.undo(),
      onCarry: (ray, isStart) => this.carrySpecimen(ray, isStart),
      onWish: (wish) => {
        if (typeof wish === "string") options.onCommand(wish);
        else options.onAction(wish);
      },
    });
    this.tiles = new TileTarget(specimen.group, options.onChoose, options.objectAlong);
    this.grips = new Grips({
      ...{ controllers: this.controllers, pointer: this.pointer },
      ...{ mover: this.mover, tiles: this.tiles },
      aim: () => ({ gaze: this.gaze, free: this.free }),
      run: (command, state, share) => this.run(command, state, share),
      onPress: (ray, time_ms) => this.press(ray, time_ms),
      onTap: (time_ms) => this.tap(time_ms),
    });
    const { pointer, controllers, grips, panel } = this;
    this.light = new PointedLight({ pointer, controllers, grips, panel });
    this.targets = [...this.panel.targets, ...handles(), this.tiles];
    scene.add(...this.overlays);
  }

  /** What is no opaque thing, which the pass for the depth has to leave out. */
  get overlays() {
    const { controllers, panel, ring, notice, ground } = this;
    return [controllers.group, panel.group, ring.group, notice.mesh, ground.lines];
  }

  /** The ring of a dwell. */
  get ring(): Ring {
    return this.light.ring;
  }

  /** The target met now, for tests and for names on gaze: `tile:r0_c1`, `panel:mode=disc`. */
  get pointed(): string | null {
    return this.pointer.leading?.key ?? null;
  }

  /** Of the dwell, 0..1. */
  get progress(): number {
    return this.pointer.progress;
  }

  /** Whether the gaze carries a handle or the specimen. */
  get isCarrying(): boolean {
    return this.carry.isCarrying;
  }

  /** Whether the gaze or the head carries something of the scene, not a part of the open menu. */
  private get isCarryingInScene(): boolean {
    const { key } = this.carry;
    const isOfMenu = key?.startsWith(PANEL) === true && key !== CARRY_BUTTON;
    return this.grips.headHold !== null || (key !== null && !isOfMenu);
  }

  /** @param session null: split screen, without any controllers */
  enter(session: XRSession | null, setting: Setting): void {
    this.panel.setting = setting;
    this.start(session);
    this.ground.show(setting === "before-eyes");
    if (isToBeTold()) this.announce(howItWorks(setting));
  }

  /** The panel's controls as a head sees them. */
  menuFrom(head: Matrix4): readonly MenuEntry[] {
    return menuEntries(this.panel.places, head);
  }

  /** As `enter` does, without the card that says how it works. */
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

  /** Press the only button of the split screen, or a key in its place. @param time_ms on the clock of events */
  tap(time_ms = this.now_ms()): void {
    this.taps.push(time_ms);
  }

  /** What fingers do on the split screen. */
  touch(gesture: Gesture, time_ms = this.now_ms()): void {
    this.gestures.push([gesture, time_ms]);
  }

  /** Say something where the head looks. */
  announce(text: string): void {
    if (this.isRunning) this.notice.announce(text);
  }

  /** What would move the camera of a flat screen, by a step; false: the command is another's. */
  run(command: Command, state: ViewerState, share = 1): boolean {
    return this.mover.run(command, state, this.gaze.origin, share);
  }

  /** The specimen becomes so much larger about its middle. */
  resize(factor: number, state: ViewerState): void {
    this.mover.resize(factor, state, this.gaze.origin);
  }

  /**
   * Once a frame of stereo, before it is drawn. True if the picture differs from the last one.
   *
   * @param read_s for which notices could be read, s: of a slow frame more than what hands can move in
   */
  update(dt_s: number, head: Matrix4, state: ViewerState, read_s = dt_s): boolean {
    if (!this.isRunning) return false;
    const { xr } = this.options;
    this.gaze = gazeOf(head);
    this.state = state;
    this.tiles.tiles = shownTiles(this.options.tiles, state.isolated);
    this.tiles.follow(state);
    this.controllers.update(xr.getFrame() ?? null, xr.getReferenceSpace());
    for (const event of this.controllers.take()) this.grips.handle(event);
    const hasTouched = this.grips.followFingers(this.gestures.splice(0), state);
    for (const time_ms of this.taps.splice(0)) this.press(this.gaze, time_ms);
    this.grips.forgetTheLost();
    const hasHeld = this.grips.hold(dt_s);
    const hasFollowed = this.grips.followHead(dt_s, state);
    const hasMoved = this.grips.moveBySticks(dt_s, state) || hasHeld || hasTouched || hasFollowed;
    const isGoingOn = this.grips.isGoingOn || this.carry.isCarrying;
    const now = { state, pose: this.mover.pose };
    const isAsked = this.pointer.gaze?.key === UNDO;
    this.panel.canUndo = this.lastChoice.advance(dt_s, now, isGoingOn, isAsked);
    this.panel.isCarrying = this.isCarryingInScene;
    const isRepainted = this.panel.update(dt_s, head, state);
    const isNoticeNew = this.notice.update(read_s, head, this.panel.upperEdge);
    const rays = this.carry.isCarrying ? [] : this.grips.tracked.map(({ ray }) => ray);
    const fired = this.pointer.advance(this.gaze, rays, this.free, dt_s, state.isDwellOn);
    if (fired?.key === GAZE_SWITCH && state.isDwellOn) this.announce(KEEPS_GAZE);
    else if (fired !== null) {
      this.choose(fired, this.now_ms(), true);
      this.grips.goOnWith(fired);
    }
    const hasGone = this.grips.goOn(dt_s, state);
    const hasCarried = this.carry.follow(this.gaze);
    return this.light.draw(head) || hasMoved || isRepainted || isNoticeNew || hasGone || hasCarried;
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

  /** A carried thing covers all else until the gaze puts it down. */
  private get free(): readonly Target[] {
    if (this.grips.headHold !== null) return []; // nothing is chosen on the way
    return this.carry.isCarrying ? [this.carry] : this.targets;
  }

  /** The button: what the ray meets, or if that is nothing, what is gazed at. */
  private press(ray: RoomRay, time_ms: number): void {
    const met = meetFirst(ray, this.free) ?? meetFirst(this.gaze, this.free);
    if (met !== null) this.choose(met, time_ms);
  }

  private choose(met: Met, time_ms: number, isByGaze = false): void {
    if (met.key === null) return;
    const counts = this.pointer.press(met, this.free, time_ms);
    if (!counts && !isByGaze) return;
    const { pose } = this.mover;
    if (met.key !== UNDO && this.state) this.lastChoice.remember({ state: this.state, pose });
    met.target.choose(met, met.ray, isByGaze);
    if (met.hold === "carry" && met.ray === this.gaze) this.carry.take(met);
  }

  private undo(): void {
    const before = this.lastChoice.take();
    if (before === null) return;
    this.options.onAction({ type: "restore", state: before.state });
    this.mover.backTo(before.pose, this.gaze.origin);
  }

  /** The bar is taken hold of, and the specimen moves as the gaze does until it rests. */
  private carrySpecimen(gaze: RoomRay, isStart: boolean): void {
    if (isStart && this.state !== null) {
      this.barHold = this.mover.holdBy(gaze, this.state);
      this.announce(CARRY);
    } else if (this.barHold !== null) {
      this.mover.to(moveByGaze(this.barHold, gaze), gaze.origin);
    }
  }
}
