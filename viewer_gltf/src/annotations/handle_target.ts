/** The handles as what a ray of the gaze or of a hand meets and carries in the room. */
import { Matrix4, Vector3 } from "three";
import type { Hit, SceneRay, Target } from "../interaction/ray_pointer";
import { rayAlong } from "../interaction/rays";
import { placeText } from "../interaction/tile_target";
import { type Handle, type HandleId, pickHandle } from "../marks/clip_handles";
import { isLampHandle } from "../marks/lamp_handles";

const HANDLE = "handle:";

export class HandleTarget implements Target {
  /** Handles are seen through what lies before them. */
  readonly isOnTop = true;
  /** From um to the room. */
  specimen = new Matrix4();
  /** The cut is as it was when stereo began, so that a gaze that rests ahead takes none of its handles; a button does. */
  isCutAsleep = false;
  /** All that there are, um. */
  handles: readonly Handle[] = [];
  /** What a ray has met or dragged since this was last taken. */
  private seen: HandleId | null = null;
  private readonly toSpecimen = new Matrix4();

  /** The handles and where they are: one that comes under a resting gaze was not looked for. */
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
    // it is dragged from now on, by the pointer that holds it
  }

  drag(key: string, ray: SceneRay): void {
    const handle = this.handles.find(({ id }) => HANDLE + id === key);
    if (handle === undefined) return; // the cut or the lamp was turned off meanwhile
    this.seen = handle.id;
    this.onDrag(handle.id, this.into(ray));
  }

  /** What is to be lit up: asked for once a frame. */
  takeSeen(): HandleId | null {
    const { seen } = this;
    this.seen = null;
    return seen;
  }

  private into(ray: SceneRay) {
    return rayAlong(ray, this.toSpecimen.copy(this.specimen).invert());
  }
}
