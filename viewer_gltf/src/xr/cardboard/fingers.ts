/**
 * Fingers on the split screen: one that goes down and up again taps, which is a Cardboard's button;
 * one that goes its way drags, two pinch. Nothing is tapped before the finger is up. px.
 */
export type Place = Readonly<{ x: number; y: number }>;

/** Ways are shares of the screen's height, to the right and down. */
export type Gesture =
  /** A finger rests on the screen; until `release` it may go on resting. */
  | Readonly<{ kind: "press" | "release" | "tap" }>
  | Readonly<{ kind: "drag"; x: number; y: number }>
  /** `factor`: of the fingers' distance. */
  | Readonly<{ kind: "pinch"; factor: number; x: number; y: number }>;

/** Way of a finger that still taps, px: a thumb rolls. */
const TAP_PX = 10;
/** Least distance of two fingers, px: closer ones give no factor. */
const NEAR_PX = 10;

export class Fingers {
  /** Where each is, in the order in which they came. */
  private readonly at = new Map<number, Place>();
  /** Where the only finger went down, while it rests there. */
  private rest: Place | null = null;

  down(id: number, at: Place): readonly Gesture[] {
    this.at.set(id, at);
    if (this.at.size === 1) {
      this.rest = at;
      return [{ kind: "press" }];
    }
    return this.leaveRest();
  }

  /** @param height_px of the screen */
  move(id: number, to: Place, height_px: number): readonly Gesture[] {
    const from = this.at.get(id);
    if (from === undefined) return []; // a mouse without a button
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

  /** The browser takes the finger for itself. */
  cancel(id: number): readonly Gesture[] {
    this.at.delete(id);
    return this.leaveRest();
  }

  private leaveRest(): readonly Gesture[] {
    if (this.rest === null) return [];
    this.rest = null;
    return [{ kind: "release" }];
  }

  /** The first two: their middle, and how far they are apart. */
  private get pair(): (Place & { readonly apart: number }) | null {
    const [a, b] = this.at.values();
    if (a === undefined || b === undefined) return null;
    return { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, apart: Math.hypot(a.x - b.x, a.y - b.y) };
  }
}

/** Calls `onGesture` for what fingers, or a mouse, do on an element, until `signal`. */
export function listenForFingers(
  element: HTMLElement,
  onGesture: (gesture: Gesture) => void,
  signal: AbortSignal,
): void {
  const fingers = new Fingers();
  const tell = (gestures: readonly Gesture[]) => {
    for (const gesture of gestures) onGesture(gesture);
  };
  const at = ({ clientX: x, clientY: y }: PointerEvent): Place => ({ x, y });
  const on = (
    type: "pointerdown" | "pointermove" | "pointerup" | "pointercancel",
    read: (event: PointerEvent) => readonly Gesture[],
  ) => element.addEventListener(type, (event) => tell(read(event)), { signal });
  on("pointerdown", (event) => fingers.down(event.pointerId, at(event)));
  on("pointermove", (event) => {
    return fingers.move(event.pointerId, at(event), Math.max(1, element.clientHeight));
  });
  on("pointerup", (event) => fingers.up(event.pointerId));
  on("pointercancel", (event) => fingers.cancel(event.pointerId));
}
