/** Undo and redo of the user's steps, and the return from a single change. */
import type { CameraPose } from "../interaction/named_views";
import { isSameCameraPose } from "../interaction/orbit_camera";
import type { Action } from "../state/actions";
import type { CameraView } from "../state/camera_view";
import { isSameView, keyOfChange, nameOfChange } from "../state/history";
import { REFUSED } from "../state/refusals";
import type { ViewerState } from "../state/viewer_state";
import { Steps } from "./steps";
import type { Viewpoint } from "./viewpoint";

/** A moment to which `takeBack` can return. */
export type Mark = Readonly<{
  state: ViewerState;
  camera: CameraView | null;
  look: CameraPose;
  newest: object | null;
}>;

export type UndoOptions = Readonly<{
  viewpoint: Viewpoint;
  state: () => ViewerState;
  isInStereo: () => boolean;
  restore: (state: ViewerState) => void;
  announce: (text: string) => void;
  /** Called when the panel has to show what can be undone now. */
  onChange: () => void;
  signal: AbortSignal;
}>;

export class Undo {
  private readonly steps: Steps;

  constructor(private readonly options: UndoOptions) {
    const { viewpoint, state, isInStereo, signal } = options;
    this.steps = new Steps(
      () => ({ state: state(), camera: viewpoint.cameraView, isInStereo: isInStereo() }),
      signal,
    );
    viewpoint.navigation.controls.addEventListener("start", () => this.noteCameraMove());
  }

  /** Name of the change that undo would take back; null: none. */
  get undoes(): string | null {
    return this.steps.undoes;
  }

  get redoes(): string | null {
    return this.steps.redoes;
  }

  /** If the camera has moved since the last step, adds an undo step for that move. */
  noteCameraMove(): void {
    this.steps.note();
  }

  /** Adds the step of an action that leads to the next state. */
  add(action: Action, next: ViewerState): void {
    const state = this.options.state();
    if (!isSameView(state, next)) this.steps.add(nameOfChange(action, state), keyOfChange(action));
  }

  step(command: "undo" | "redo"): void {
    const { viewpoint, isInStereo, restore, announce, onChange } = this.options;
    const found = command === "undo" ? this.steps.undo() : this.steps.redo();
    if (found === null) {
      announce(REFUSED[command]);
      return;
    }
    const { state, camera, isInStereo: wasInStereo } = found.moment;
    restore(state);
    // in stereo the head looks, and the specimen stays where it was placed
    if (!wasInStereo && !isInStereo()) viewpoint.restore(camera);
    announce(`${command === "undo" ? "Undone" : "Redone"}: ${found.name}.`);
    onChange();
  }

  get mark(): Mark {
    const { viewpoint, state } = this.options;
    const { cameraView: camera, navigation } = viewpoint;
    return { state: state(), camera, look: navigation.cameraPose, newest: this.steps.newest };
  }

  /** Returns whether the user would see a difference since a mark. */
  hasChangedSince({ state, look }: Mark): boolean {
    const { viewpoint, state: now } = this.options;
    return !isSameView(state, now()) || !isSameCameraPose(look, viewpoint.navigation);
  }

  /** The newest undo step, from which `takeBack` counts the steps to undo; null: there are none. */
  get newest(): object | null {
    return this.steps.newest;
  }

  /** Returns to the state and the camera of a mark. */
  takeBack({ state, camera, newest }: Mark): void {
    const { viewpoint, isInStereo, onChange } = this.options;
    if (!isSameView(state, this.options.state())) {
      // at least one step is undone: a change that was joined to the step before the mark added no
      // step
      for (let left = Math.max(1, this.steps.since(newest)); left > 0; left--) this.step("undo");
    }
    if (!isInStereo()) viewpoint.restore(camera);
    onChange();
  }

  /** Clears the history. Changes made while opening are not steps that a user can undo. */
  forget(): void {
    this.steps.forget();
    this.options.onChange();
  }
}
