/** The handles as a target that a ray of the gaze or of a hand can hit and drag in stereo. */
import { Matrix4, Vector3 } from "three";
import type { Hit, SceneRay, Target } from "../interaction/ray_pointer";
import { rayAlong } from "../interaction/rays";
import { placeText } from "../interaction/tile_target";
import { type Handle, type HandleId, pickHandle } from "../marks/clip_handles";
import { isLampHandle } from "../marks/lamp_handles";

const HANDLE = "handle:";

export class HandleTarget implements Target {
  /** Handles also count if something lies in front of them, because they are drawn through it. */
  readonly isOnTop = true;
  /** Matrix from um to the scene. */
  specimen = new Matrix4();
  /** Whether the clip has not changed since stereo began. A resting gaze then grabs none of its handles; a button does. */
  isCutAsleep = false;
  /** All handles, in um. */
  handles: readonly Handle[] = [];
  /** The handle that a ray has hit or dragged since the last call of `takeSeen`. */
  private seen: HandleId | null = null;
  private readonly toSpecimen = new Matrix4();

  /** Text that changes when a handle moves. A handle that moves under a resting gaze was not chosen by the user. */
  get layout(): string {
    const places = this.handles.map(({ id, position }) => `${id} ${position}`);
    return `handles ${places} ${placeText(this.specimen)}`;
  }

  constructor(
    private readonly tolerance_rad: number,
    /** The ray is in um. */
    private readonly onDrag: (id: HandleId, ray: ReturnType<typeof rayAlong>) => void,
  ) {}

  intersect(ray: SceneRay): Hit | null {
    if (this.handles.length === 0) return null;
    const id = pickHandle(this.into(ray), this.handles, this.tolerance_rad);
    const handle = this.handles.find((each) => each.id === id);
    if (handle === undefined) return null;
    this.seen = handle.id;
    const place = new Vector3(...handle.position).applyMatrix4(this.specimen);
    const key = HANDLE + id;
    const distance_m = place.distanceTo(ray.origin);
    const isGlance = this.isCutAsleep && !isLampHandle(handle.id);
    return { key, place: key, distance_m, hold: "carry", isGlance };
  }

  choose(): void {
    // the pointer that holds the handle calls `drag` from now on
  }

  drag(key: string, ray: SceneRay): void {
    const handle = this.handles.find(({ id }) => HANDLE + id === key);
    if (handle === undefined) return; // the clip or the lamp was switched off meanwhile
    this.seen = handle.id;
    this.onDrag(handle.id, this.into(ray));
  }

  /** Returns the handle to highlight in this frame, and forgets it; null: none. */
  takeSeen(): HandleId | null {
    const { seen } = this;
    this.seen = null;
    return seen;
  }

  private into(ray: SceneRay) {
    return rayAlong(ray, this.toSpecimen.copy(this.specimen).invert());
  }
}
