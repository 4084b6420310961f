/**
 * Buttons, hands and fingers that hold something: a repeating control, a handle, or the specimen.
 */
import type { Vector3 } from "three";
import {
  firstHit,
  type Pointer,
  pointOn,
  type SceneRay,
  type Target,
  type TargetHit,
} from "../interaction/ray_pointer";
import { TILE, type TileTarget } from "../interaction/tile_target";
import type { HandPose } from "../math/grab";
import type { Command } from "../state/commands";
import type { ViewerState } from "../state/viewer_state";
import type { Gesture } from "./cardboard/fingers";
import type { Controllers, Hand, HandEvent } from "./controllers";
import {
  type HeadHold,
  moveByHead,
  moveByHolders,
  moveByStick,
  STEPS_PER_S,
} from "./hold_specimen";
import type { SpecimenMover } from "./specimen_mover";

/** Without a squeeze button, a trigger holds the specimen after this time, s, or this motion, m. */
const HOLD_S = 0.35;
const HOLD_M = 0.02;
/**
 * Seconds that a Cardboard's button is held before the head holds the specimen: longer than HOLD_S,
 * since a thumb is slow.
 */
const HEAD_HOLD_S = 0.6;

type Press = {
  /** The target at which the button was pressed, and the place of the hand at that time. */
  readonly hit: TargetHit | null;
  readonly at: Vector3 | null;
  elapsed_s: number;
  /** True once the press drags or holds something: then its release chooses nothing. */
  isUsed: boolean;
};

/**
 * A control that repeats its command. `source`: the button that is held; null: the gaze rests on
 * it.
 */
type Repeating = {
  readonly hit: TargetHit;
  readonly source: XRInputSource | "finger" | null;
  elapsed_s: number;
};

/** A gesture on the split screen, with its time on the clock of events. */
export type TimedGesture = readonly [Gesture, time_ms: number];

export type GripOptions = Readonly<{
  controllers: Controllers;
  pointer: Pointer;
  mover: SpecimenMover;
  tiles: TileTarget;
  /** The gaze, and the targets that can be chosen now. */
  aim: () => Readonly<{ gaze: SceneRay; choosable: readonly Target[] }>;
  /** Moves the specimen by a share of a command's step, and returns whether it moved. */
  run: (command: Command, state: ViewerState, share: number) => boolean;
  onPress: (ray: SceneRay, time_ms: number) => void;
  onTap: (time_ms: number) => void;
}>;

export class Grips {
  private readonly presses = new Map<XRInputSource, Press>();
  /** The hands that hold the specimen, and their poses in the last frame. */
  private held = new Map<XRInputSource, HandPose | null>();
  /**
   * A finger that rests on the split screen; `hit`: the target under the gaze when it went down.
   */
  private touched: { hit: TargetHit | null; isUsed: boolean; elapsed_s: number } | null = null;
  /** Set while the head holds the specimen because a button is held. */
  headHold: HeadHold | null = null;
  private repeating: Repeating | null = null;
  private readonly mover: SpecimenMover;
  private readonly pointer: Pointer;

  constructor(private readonly options: GripOptions) {
    this.mover = options.mover;
    this.pointer = options.pointer;
  }

  get isHolding(): boolean {
    return this.held.size > 0;
  }

  get isRepeating(): boolean {
    return this.repeating !== null;
  }

  get tracked(): readonly Hand[] {
    return this.options.controllers.hands.filter(({ isTracked }) => isTracked);
  }

  private get aim() {
    return this.options.aim();
  }

  /** Repeats a control's command while the gaze rests on it. */
  startRepeating(hit: TargetHit): void {
    if (hit.repeats !== undefined) this.repeating = { hit, source: null, elapsed_s: 0 };
  }

  drop(): void {
    this.presses.clear();
    this.held.clear();
    this.touched = null;
    this.repeating = null;
    this.headHold = null;
  }

  private handOf(source: XRInputSource): Hand | undefined {
    return this.options.controllers.hands.find((hand) => hand.source === source);
  }

  handle({ kind, source, ray, time_ms }: HandEvent): void {
    const press = this.presses.get(source);
    switch (kind) {
      case "press":
        this.presses.set(source, this.begin(source, ray, time_ms));
        break;
      case "select":
        if (!press?.isUsed) this.options.onPress(ray ?? this.aim.gaze, time_ms);
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

  private begin(source: XRInputSource, ray: SceneRay | null, time_ms: number): Press {
    const hit = firstHit(ray ?? this.aim.gaze, this.aim.choosable);
    // A Cardboard's button can't be held for long: one tap picks up a handle, and the next puts it
    // down.
    const isUsed = hit?.hold === "slide" || (hit?.hold === "carry" && ray !== null);
    if (hit !== null && isUsed && this.pointer.press(hit, this.aim.choosable, time_ms)) {
      hit.target.choose(hit, hit.ray, false);
    }
    if (hit?.repeats !== undefined) this.repeating = { hit, source, elapsed_s: 0 };
    const at = this.handOf(source)?.pose?.position ?? null;
    return { hit, at, elapsed_s: 0, isUsed };
  }

  /**
   * Applies the gestures on the split screen since the last frame. Returns whether the specimen
   * moved.
   */
  followFingers(gestures: readonly TimedGesture[], state: ViewerState): boolean {
    const before = this.mover.pose;
    for (const [gesture, time_ms] of gestures) {
      if (gesture.kind === "press") {
        const hit = firstHit(this.aim.gaze, this.aim.choosable);
        this.touched = { hit, isUsed: false, elapsed_s: 0 };
        if (hit?.repeats !== undefined) this.repeating = { hit, source: "finger", elapsed_s: 0 };
      } else if (gesture.kind === "release") this.touched = null;
      else if (gesture.kind === "tap") {
        if (this.touched?.isUsed === false) this.options.onTap(time_ms);
      } else {
        this.mover.byFingers(gesture, state, this.aim.gaze.origin);
      }
    }
    return this.mover.pose !== before;
  }

  /** Forgets input sources that have disconnected, even while they held something. */
  forgetLostSources(): void {
    for (const map of [this.presses, this.held]) {
      for (const source of [...map.keys()]) {
        if (this.handOf(source) === undefined) map.delete(source);
      }
    }
  }

  /** Drags and holds with the buttons that are down. Returns whether the specimen moved. */
  hold(dt_s: number): boolean {
    for (const [source, press] of this.presses) this.advance(source, press, dt_s);
    const now = new Map([...this.held.keys()].map((key) => [key, this.handOf(key)?.pose ?? null]));
    const pose = moveByHolders(this.mover.pose, this.held, now);
    this.held = now;
    return this.mover.moveTo(pose, this.aim.gaze.origin);
  }

  private advance(source: XRInputSource, press: Press, dt_s: number): void {
    const hand = this.handOf(source);
    press.elapsed_s += dt_s;
    const { hit } = press;
    if (hit?.key == null) return;
    if (hit.hold !== undefined) {
      if (press.isUsed) hit.target.drag?.(hit.key, hand?.ray ?? this.aim.gaze);
      return;
    }
    const mayHold = hand?.pose && !hand.canSqueeze && hit.key.startsWith(TILE);
    if (press.isUsed || !mayHold || !hand?.pose) return;
    const isFar = press.at !== null && press.at.distanceTo(hand.pose.position) > HOLD_M;
    if (!isFar && press.elapsed_s < HOLD_S) return;
    press.isUsed = true;
    this.held.set(source, null);
  }

  /**
   * Repeats the command of a control while it is gazed at or held. Returns whether the specimen
   * moved.
   */
  repeat(dt_s: number, state: ViewerState): boolean {
    const { repeating } = this;
    if (repeating === null) return false;
    const { hit, source } = repeating;
    const press = typeof source === "object" ? source && this.presses.get(source) : this.touched;
    const isHeld = source === null || press != null;
    const ray = (typeof source === "object" && source && this.handOf(source)?.ray) || this.aim.gaze;
    if (
      !isHeld ||
      firstHit(ray, this.aim.choosable)?.key !== hit.key ||
      hit.repeats === undefined
    ) {
      this.repeating = null;
      return false;
    }
    repeating.elapsed_s += dt_s;
    if (repeating.elapsed_s < HOLD_S) return false;
    // the release of the button then does not count as another step
    if (press != null) press.isUsed = true;
    return this.options.run(hit.repeats, state, STEPS_PER_S * dt_s);
  }

  /**
   * Moves the specimen with the head while a button is held outside the controls and no hand is
   * tracked. Returns whether the specimen moved.
   */
  followHead(dt_s: number, state: ViewerState): boolean {
    if (this.touched !== null) this.touched.elapsed_s += dt_s;
    const handless = [...this.presses].filter(([source]) => this.handOf(source)?.pose == null);
    const press = [this.touched, ...handless.map(([, each]) => each)].find(
      (each) => each != null && (each.isUsed ? this.headHold !== null : mayFollow(each.hit)),
    );
    if (press == null || press.elapsed_s < HEAD_HOLD_S) {
      this.headHold = null;
      return false;
    }
    const { gaze } = this.aim;
    press.isUsed = true; // the release of the button then chooses nothing
    if (this.headHold === null) {
      this.headHold = this.mover.holdBy(gaze, state);
      return false;
    }
    this.mover.moveTo(moveByHead(this.headHold, gaze), gaze.origin);
    return true;
  }

  moveBySticks(dt_s: number, state: ViewerState): boolean {
    if (this.isHolding) return false;
    let { pose } = this.mover;
    for (const { stick, ray } of this.tracked) {
      if (stick.x === 0 && stick.y === 0) continue;
      const hit = this.tileAlong(ray) ?? this.tileAlong(this.aim.gaze);
      pose = moveByStick(pose, stick, hit ?? this.mover.middle(state), dt_s);
    }
    return this.mover.moveTo(pose, this.aim.gaze.origin);
  }

  private tileAlong(ray: SceneRay | null): Vector3 | null {
    const hit = ray && this.options.tiles.intersect(ray);
    return hit && pointOn({ ...hit, ray });
  }
}

/**
 * Whether the head may hold the specimen by a button that was pressed on this target: controls use
 * the button themselves.
 */
function mayFollow(hit: TargetHit | null): boolean {
  return hit === null || hit.key?.startsWith(TILE) === true;
}
