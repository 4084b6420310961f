/**
 * Everything that is done in stereo: looking, pointing, pressing, holding. One of it serves both
 * WebXR and the split screen, where there is nothing but the gaze and a tap.
 */
import { Matrix4, Vector3 } from "three";
import { Ring } from "../interaction/dwell_ring";
import {
  gazeOf,
  type Met,
  meetFirst,
  Pointer,
  type RoomRay,
  type Target,
} from "../interaction/ray_pointer";
import { TILE, TileTarget } from "../interaction/tile_target";
import type { HandPose } from "../math/grab";
import { shownTiles } from "../math/pick";
import type { Command } from "../state/commands";
import { DWELL } from "../state/parameters/tools";
import type { ViewerState } from "../state/viewer_state";
import type { Gesture } from "./cardboard/fingers";
import { GazeCarry } from "./carry_handle";
import { Controllers, type Hand, type HandEvent } from "./controllers";
import { Ground } from "./ground";
import type { HandsOptions } from "./hands_options";
import {
  type HeadHold,
  moveByGaze,
  moveByHead,
  moveByHolders,
  moveByStick,
  STEPS_PER_S,
} from "./hold_specimen";
import { howItWorks, isToBeTold } from "./how_it_works";
import { LastChoice } from "./last_choice";
import { type MenuEntry, menuEntries } from "./panel/menu_entries";
import { RoomNotice } from "./panel/notice";
import { PANEL, RoomPanel } from "./panel/panel";
import type { Setting } from "./panel/placement";
import { SpecimenMover } from "./specimen_mover";

/** Without a squeeze button, a trigger holds the specimen after this time, s, or this way, m. */
const HOLD_S = 0.35;
const HOLD_M = 0.02;
/** Time for which a Cardboard's button is held before the head holds the specimen by it, s: a thumb is slow. */
const HEAD_HOLD_S = 0.6;

/** By gaze alone it is not switched off: nothing would be left to switch it on by. */
const GAZE_SWITCH = `${PANEL}${DWELL.id}`;
const KEEPS_GAZE = "Switch this off by the button: where there is none, the gaze is all there is.";

const CARRY = "It moves with your gaze. Rest to put it down.";
/** The bar's button that undoes the last choice. */
const UNDO = `${PANEL}undo-choice`;
/** The bar's button by which the gaze takes the specimen. */
const CARRY_BUTTON = `${PANEL}bar-move`;

/** A trigger that is down. */
type Press = {
  /** Where it went down. */
  readonly met: Met | null;
  readonly at: Vector3 | null;
  elapsed_s: number;
  /** It drags or holds something: letting go of it chooses nothing. */
  isUsed: boolean;
};

/** `source`: of the button that is held; null: the gaze stays. */
type GoesOn = {
  readonly met: Met;
  readonly source: XRInputSource | "finger" | null;
  elapsed_s: number;
};

export class Hands {
  readonly panel: RoomPanel;
  readonly ring = new Ring();
  readonly notice: RoomNotice;
  readonly ground = new Ground();
  private readonly mover: SpecimenMover;
  private readonly controllers = new Controllers();
  private readonly pointer = new Pointer();
  readonly tiles: TileTarget;
  private readonly targets: readonly Target[];
  private readonly carry = new GazeCarry();
  private readonly presses = new Map<XRInputSource, Press>();
  /** The hands that hold the specimen, and their places in the frame before. */
  private held = new Map<XRInputSource, HandPose | null>();
  private gaze: RoomRay = gazeOf(new Matrix4());
  /** Times at which the button was pressed since the previous frame, ms. */
  private taps: number[] = [];
  private isRunning = false;
  private shown = "";
  private gestures: (readonly [Gesture, time_ms: number])[] = [];
  /** A finger that rests on the split screen; `met`: what was gazed at when it came. */
  private touched: { met: Met | null; isUsed: boolean; elapsed_s: number } | null = null;
  /** The head holds the specimen by a button that is down. */
  private headHold: HeadHold | null = null;
  /** What is gone on with. */
  private goesOn: GoesOn | null = null;
  private readonly lastChoice = new LastChoice();
  /** The specimen as it was taken by the bar. */
  private barHold: HeadHold | null = null;
  private state: ViewerState | null = null;
  constructor(private readonly options: HandsOptions) {
    const { scene, specimen, handles = () => [], layOut, onLeave } = options;
    const { onLenses = () => undefined, isPainted = true } = options;
    this.mover = new SpecimenMover(specimen, options.tiles);
    this.notice = new RoomNotice(isPainted);
    this.panel = new RoomPanel({
      layOut,
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
    this.tiles = new TileTarget(specimen.group, options.onChoose);
    if (options.objectAlong !== undefined) this.tiles.objectAlong = options.objectAlong;
    this.targets = [...this.panel.targets, ...handles(), this.tiles];
    scene.add(...this.overlays);
  }

  /** What is no opaque thing, which the pass for the depth has to leave out. */
  get overlays() {
    const { controllers, panel, ring, notice, ground } = this;
    return [controllers.group, panel.group, ring.group, notice.mesh, ground.lines];
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
    return this.headHold !== null || (key !== null && !isOfMenu);
  }

  get isHolding(): boolean {
    return this.held.size > 0;
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
    this.presses.clear();
    this.held.clear();
    this.taps = [];
    this.gestures = [];
    this.touched = null;
    this.goesOn = null;
    this.headHold = null;
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
    for (const event of this.controllers.take()) this.handle(event);
    const hasTouched = this.followFingers(state);
    for (const time_ms of this.taps.splice(0)) this.press(this.gaze, time_ms);
    this.forgetTheLost();
    const hasHeld = this.hold(dt_s);
    const hasFollowed = this.followHead(dt_s, state);
    const hasMoved = this.moveBySticks(dt_s, state) || hasHeld || hasTouched || hasFollowed;
    const isGoingOn = this.goesOn !== null || this.carry.isCarrying;
    const now = { state, pose: this.mover.pose };
    const isAsked = this.pointer.gaze?.key === UNDO;
    this.panel.canUndo = this.lastChoice.advance(dt_s, now, isGoingOn, isAsked);
    this.panel.isCarrying = this.isCarryingInScene;
    const isRepainted = this.panel.update(dt_s, head, state);
    const isNoticeNew = this.notice.update(read_s, head, this.panel.upperEdge);
    const rays = this.carry.isCarrying ? [] : this.tracked.map(({ ray }) => ray);
    const fired = this.pointer.advance(this.gaze, rays, this.free, dt_s, state.isDwellOn);
    if (fired?.key === GAZE_SWITCH && state.isDwellOn) this.announce(KEEPS_GAZE);
    else if (fired !== null) {
      this.choose(fired, this.now_ms(), true);
      if (fired.repeats !== undefined) this.goesOn = { met: fired, source: null, elapsed_s: 0 };
    }
    const hasGone = this.goOn(dt_s, state);
    const hasCarried = this.carry.follow(this.gaze);
    return this.draw(head) || hasMoved || isRepainted || isNoticeNew || hasGone || hasCarried;
  }

  dispose(): void {
    this.stop();
    const { scene } = this.options;
    scene.remove(...this.overlays);
    this.panel.dispose();
    this.notice.dispose();
    this.controllers.dispose();
    this.ring.dispose();
    this.ground.dispose();
  }

  private now_ms(): number {
    return (this.options.now_ms ?? (() => performance.now()))();
  }

  private get tracked(): readonly Hand[] {
    return this.controllers.hands.filter(({ isTracked }) => isTracked);
  }

  /** A carried thing covers all else until the gaze puts it down. */
  private get free(): readonly Target[] {
    if (this.headHold !== null) return []; // nothing is chosen on the way
    return this.carry.isCarrying ? [this.carry] : this.targets;
  }

  private handOf(source: XRInputSource): Hand | undefined {
    return this.controllers.hands.find((hand) => hand.source === source);
  }

  private handle({ kind, source, ray, time_ms }: HandEvent): void {
    const press = this.presses.get(source);
    switch (kind) {
      case "press":
        this.presses.set(source, this.begin(source, ray, time_ms));
        break;
      case "select":
        if (!press?.isUsed) this.press(ray ?? this.gaze, time_ms);
        break;
      case "release":
        this.presses.delete(source);
        if (press?.isUsed) this.held.delete(source);
        break;
      case "squeeze":
        this.held.set(source, null);
        break;
      case "let-go":
        this.held.delete(source);
        break;
    }
  }

  private begin(source: XRInputSource, ray: RoomRay | null, time_ms: number): Press {
    const met = meetFirst(ray ?? this.gaze, this.free);
    // A tap takes up a handle and another puts it down; nobody's thumb holds a Cardboard's button.
    const isUsed = met?.hold === "slide" || (met?.hold === "carry" && ray !== null);
    if (met !== null && isUsed && this.pointer.press(met, this.free, time_ms)) {
      met.target.choose(met, met.ray, false);
    }
    if (met?.repeats !== undefined) this.goesOn = { met, source, elapsed_s: 0 };
    const at = this.handOf(source)?.pose?.position ?? null;
    return { met, at, elapsed_s: 0, isUsed };
  }

  /** What fingers on the split screen have done since the frame before; whether anything has moved. */
  private followFingers(state: ViewerState): boolean {
    const before = this.mover.pose;
    for (const [gesture, time_ms] of this.gestures.splice(0)) {
      if (gesture.kind === "press") {
        const met = meetFirst(this.gaze, this.free);
        this.touched = { met, isUsed: false, elapsed_s: 0 };
        if (met?.repeats !== undefined) this.goesOn = { met, source: "finger", elapsed_s: 0 };
      } else if (gesture.kind === "release") this.touched = null;
      else if (gesture.kind === "tap") {
        if (this.touched?.isUsed === false) this.tap(time_ms);
      } else {
        this.mover.byFingers(gesture, state, this.gaze.origin);
      }
    }
    return this.mover.pose !== before;
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

  /** Input sources come and go, also while they hold something. */
  private forgetTheLost(): void {
    for (const map of [this.presses, this.held]) {
      for (const source of [...map.keys()]) {
        if (this.handOf(source) === undefined) map.delete(source);
      }
    }
  }

  /** What the buttons that are down drag and hold; whether anything has moved. */
  private hold(dt_s: number): boolean {
    for (const [source, press] of this.presses) this.advance(source, press, dt_s);
    const now = new Map([...this.held.keys()].map((key) => [key, this.handOf(key)?.pose ?? null]));
    const pose = moveByHolders(this.mover.pose, this.held, now);
    this.held = now;
    return this.mover.to(pose, this.gaze.origin);
  }

  private advance(source: XRInputSource, press: Press, dt_s: number): void {
    const hand = this.handOf(source);
    press.elapsed_s += dt_s;
    const { met } = press;
    if (met?.key == null) return;
    if (met.hold !== undefined) {
      if (press.isUsed) met.target.drag?.(met.key, hand?.ray ?? this.gaze);
      return;
    }
    const mayHold = hand?.pose && !hand.canSqueeze && met.key.startsWith(TILE);
    if (press.isUsed || !mayHold || !hand?.pose) return;
    const isFar = press.at !== null && press.at.distanceTo(hand.pose.position) > HOLD_M;
    if (!isFar && press.elapsed_s < HOLD_S) return;
    press.isUsed = true;
    this.held.set(source, null);
  }

  /** What was chosen by a gaze that stays, or a button that is held, goes on; whether it has moved. */
  private goOn(dt_s: number, state: ViewerState): boolean {
    const { goesOn } = this;
    if (goesOn === null) return false;
    const { met, source } = goesOn;
    const press = typeof source === "object" ? source && this.presses.get(source) : this.touched;
    const isHeld = source === null || press != null;
    const ray = (typeof source === "object" && source && this.handOf(source)?.ray) || this.gaze;
    if (!isHeld || meetFirst(ray, this.free)?.key !== met.key || met.repeats === undefined) {
      this.goesOn = null;
      return false;
    }
    goesOn.elapsed_s += dt_s;
    if (goesOn.elapsed_s < HOLD_S) return false;
    if (press != null) press.isUsed = true; // letting go of it is no further step
    return this.run(met.repeats, state, STEPS_PER_S * dt_s);
  }

  /**
   * A button that is held where no control is takes the specimen along with the head, if no hand is there to
   * do it; whether it has moved.
   */
  private followHead(dt_s: number, state: ViewerState): boolean {
    if (this.touched !== null) this.touched.elapsed_s += dt_s;
    const handless = [...this.presses].filter(([source]) => this.handOf(source)?.pose == null);
    const press = [this.touched, ...handless.map(([, each]) => each)].find(
      (each) => each != null && (each.isUsed ? this.headHold !== null : mayFollow(each.met)),
    );
    if (press == null || press.elapsed_s < HEAD_HOLD_S) {
      this.headHold = null;
      return false;
    }
    const { gaze } = this;
    press.isUsed = true; // letting go of it chooses nothing
    if (this.headHold === null) {
      this.headHold = this.mover.holdBy(gaze, state);
      return false;
    }
    this.mover.to(moveByHead(this.headHold, gaze), gaze.origin);
    return true;
  }

  private moveBySticks(dt_s: number, state: ViewerState): boolean {
    if (this.isHolding) return false;
    let { pose } = this.mover;
    for (const { stick, ray } of this.tracked) {
      if (stick.x === 0 && stick.y === 0) continue;
      const met = this.tileAlong(ray) ?? this.tileAlong(this.gaze);
      pose = moveByStick(pose, stick, met ?? this.mover.middle(state), dt_s);
    }
    return this.mover.to(pose, this.gaze.origin);
  }

  private tileAlong(ray: RoomRay | null): Vector3 | null {
    const hit = ray && this.tiles.meet(ray);
    return hit && pointOn({ ...hit, ray });
  }

  /** Ring, rays, and the light on what is pointed at. */
  private draw(head: Matrix4): boolean {
    this.tracked.forEach((hand, i) => {
      this.controllers.draw(hand, this.pointer.hands[i]?.distance_m ?? null);
    });
    const { leading, progress } = this.pointer;
    this.panel.light(leading?.key ?? null);
    const eye = new Vector3().setFromMatrixPosition(head);
    if (leading === null) this.ring.hide();
    else this.ring.show(pointOn(leading), eye, progress);
    const shown = `${leading?.key} ${leading?.distance_m} ${progress}`;
    const isChanged = shown !== this.shown;
    this.shown = shown;
    return isChanged || this.tracked.length > 0;
  }
}

/** Of what was met when the button went down: a control has its own use for it. */
function mayFollow(met: Met | null): boolean {
  return met === null || met.key?.startsWith(TILE) === true;
}

function pointOn({ ray, distance_m }: Pick<Met, "ray" | "distance_m">): Vector3 {
  return ray.direction.clone().multiplyScalar(distance_m).add(ray.origin);
}
