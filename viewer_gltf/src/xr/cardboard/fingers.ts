/**
 * Gestures of fingers on the split screen, in pixels.
 * A finger that goes down and up again taps, which stands for a Cardboard's button. A finger that
 * moves drags, and two fingers pinch. A tap is reported only when the finger is lifted.
 */
export type Place = Readonly<{ x: number; y: number }>;

/** Motions are shares of the screen's height, to the right and down. */
export type Gesture =
  /** `press`: a finger rests on the screen, until `release` or `tap`. */
  | Readonly<{ kind: "press" | "release" | "tap" }>
  | Readonly<{ kind: "drag"; x: number; y: number }>
  /** `factor`: ratio of the fingers' distance after and before. */
  | Readonly<{ kind: "pinch"; factor: number; x: number; y: number }>;

/** Pixels that a finger may move and still tap, since a thumb rolls. */
const TAP_PX = 10;
/** Pixels. Two fingers closer than this change no size: the ratio of their distances would jump. */
const NEAR_PX = 10;

export class Fingers {
  /** Position of each finger by its id, in the order in which they went down. */
  private readonly at = new Map<number, Place>();
  /** Where the only finger went down; null after it has moved, or with a second finger. */
  private rest: Place | null = null;

  down(id: number, at: Place): readonly Gesture[] {
    this.at.set(id, at);
    if (this.at.size === 1) {
      this.rest = at;
      return [{ kind: "press" }];
    }
    return this.leaveRest();
  }

  move(id: number, to: Place, height_px: number): readonly Gesture[] {
    const from = this.at.get(id);
    if (from === undefined) return []; // a mouse that moves without a button
    const { rest } = this;
    if (rest !== null && Math.hypot(to.x - rest.x, to.y - rest.y) <= TAP_PX) return [];
    const before = this.pair;
    this.at.set(id, to);
    const left = this.leaveRest();
    const after = this.pair;
    if (before !== null && after !== null) {
      const factor =
        after.apart < NEAR_PX || before.apart < NEAR_PX ? 1 : after.apart / before.apart;
      const x = (after.x - before.x) / height_px;
      return [...left, { kind: "pinch", factor, x, y: (after.y - before.y) / height_px }];
    }
    const [x, y] = [(to.x - from.x) / height_px, (to.y - from.y) / height_px];
    return this.at.size === 1 ? [...left, { kind: "drag", x, y }] : left;
  }

  up(id: number): readonly Gesture[] {
    if (!this.at.delete(id) || this.rest === null) return [];
    return [{ kind: "tap" }, ...this.leaveRest()];
  }

  /** The browser has taken over the finger, for example to scroll. */
  cancel(id: number): readonly Gesture[] {
    this.at.delete(id);
    return this.leaveRest();
  }

  private leaveRest(): readonly Gesture[] {
    if (this.rest === null) return [];
    this.rest = null;
    return [{ kind: "release" }];
  }

  /** The first two fingers: their midpoint and their distance; null if there are fewer. */
  private get pair(): (Place & { readonly apart: number }) | null {
    const [a, b] = this.at.values();
    if (a === undefined || b === undefined) return null;
    return { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, apart: Math.hypot(a.x - b.x, a.y - b.y) };
  }
}

/**
 * Calls `onGesture` for gestures of fingers or a mouse on an element, until `signal` is aborted.
 */
export function listenForFingers(
  element: HTMLElement,
  onGesture: (gesture: Gesture) => void,
  signal: AbortSignal,
): void {
  const fingers = new Fingers();
  const reportAll = (gestures: readonly Gesture[]) => {
    for (const gesture of gestures) onGesture(gesture);
  };
  const at = ({ clientX: x, clientY: y }: PointerEvent): Place => ({ x, y });
  const on = (
    type: "pointerdown" | "pointermove" | "pointerup" | "pointercancel",
    read: (event: PointerEvent) => readonly Gesture[],
  ) => element.addEventListener(type, (event) => reportAll(read(event)), { signal });
  on("pointerdown", (event) => fingers.down(event.pointerId, at(event)));
  on("pointermove", (event) => {
    return fingers.move(event.pointerId, at(event), Math.max(1, element.clientHeight));
  });
  on("pointerup", (event) => fingers.up(event.pointerId));
  on("pointercancel", (event) => fingers.cancel(event.pointerId));
}
