/**
 * The user's steps for undo and redo: states of the viewer, each with the camera at that time. A
 * move of the camera is not an action, so it is noted before the next step.
 */
import type { CameraView } from "../state/camera_view";
import { type History, NO_HISTORY, redone, undone, withStep } from "../state/history";
import type { ViewerState } from "../state/viewer_state";

export type Moment = Readonly<{
  state: ViewerState;
  /** The camera at this moment; null: the camera of the opening view. */
  camera: CameraView | null;
  /** Whether the user was in stereo. The camera has no meaning there, because the head looks. */
  isInStereo: boolean;
}>;

/** Name of the undo step for a move of the camera. */
const CAMERA_STEP = "viewpoint";
/** Largest difference between two coordinates that count as equal, m. */
const SAME_M = 1e-4;

export class Steps {
  private history: History<Moment> = NO_HISTORY;
  /** The camera after the last step. */
  private seenFrom: CameraView | null;
  private gesture = 0;
  private held = 0;

  constructor(
    private readonly now: () => Moment,
    signal: AbortSignal,
  ) {
    this.seenFrom = now().camera;
    const options = { signal, capture: true };
    const change = (by: number) => () => {
      this.gesture++;
      this.held = Math.max(0, this.held + by);
    };
    addEventListener("pointerdown", change(1), options);
    addEventListener("pointerup", change(-1), options);
    addEventListener("pointercancel", change(-1), options);
  }

  get undoes(): string | null {
    const { camera, isInStereo } = this.now();
    if (!isInStereo && !isSame(camera, this.seenFrom)) return CAMERA_STEP;
    return this.history.past.at(-1)?.name ?? null;
  }

  get redoes(): string | null {
    return this.history.future[0]?.name ?? null;
  }

  /** If the camera has moved since the last step, adds an undo step for that move. */
  note(): void {
    const moment = this.now();
    if (moment.isInStereo || isSame(moment.camera, this.seenFrom)) return;
    this.push({ ...moment, camera: this.seenFrom }, CAMERA_STEP, null);
    this.seenFrom = moment.camera;
  }

  /** Adds an undo step with the present state and camera; called before the state changes. */
  add(name: string, key: string | null): void {
    this.note();
    this.push(this.now(), name, key);
  }

  undo() {
    this.note();
    return this.take(undone(this.history, this.now()));
  }

  redo() {
    const moment = this.now();
    return this.take(redone(this.history, moment));
  }

  /** The newest step, as a mark from which `since` counts; null: there are no steps. */
  get newest(): object | null {
    return this.history.past.at(-1) ?? null;
  }

  /** Returns the number of steps since a mark, including moves of the camera. */
  since(newest: object | null): number {
    this.note();
    const past: readonly (object | null)[] = this.history.past;
    return past.length - 1 - past.lastIndexOf(newest);
  }

  forget(): void {
    this.history = NO_HISTORY;
    this.seenFrom = this.now().camera;
  }

  private push(before: Moment, name: string, key: string | null): void {
    const { gesture, held } = this;
    const occasion = { key, gesture, isHeld: held > 0, time_s: performance.now() / 1000 };
    this.history = withStep(this.history, before, name, occasion);
  }

  private take(found: ReturnType<typeof undone<Moment>>) {
    if (found === null) return null;
    this.history = found.history;
    if (!found.moment.isInStereo) this.seenFrom = found.moment.camera;
    return found;
  }
}

function isSame(a: CameraView | null, b: CameraView | null): boolean {
  if (a === null || b === null) return a === b;
  const numbers = ({ position, target, specimen }: CameraView) => [
    ...[...position, ...target],
    ...(specimen === null ? [] : [...specimen.position, ...specimen.orientation, specimen.scale]),
  ];
  const [ofA, ofB] = [numbers(a), numbers(b)];
  return ofA.length === ofB.length && ofA.every((v, i) => Math.abs(v - ofB[i]) < SAME_M);
}
