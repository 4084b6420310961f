/** The slices, whose code comes when they are first shown. */
import { Object3D } from "three";
import { TemporaryError } from "../bundle/errors";
import type { Sight } from "../marks/style";
import type { ClipPlane } from "../math/clip";
import type { Vec3 } from "../math/vec3";
import type { Slices, SlicesOptions } from "../slices/slices";
import { isSliced } from "../state/parameters/slices";
import type { ViewerState } from "../state/viewer_state";

const NOT_LOADED =
  "The part of the page that shows slices could not be loaded. Check the connection and try again.";

export class SlicesPart {
  /** Child of the specimen's group: um, world. */
  readonly group = new Object3D();
  private slices: Slices | null = null;
  private coming: Promise<void> | null = null;
  /** The newest state, for when it comes. */
  private wanted: ViewerState | null = null;
  /** It could not be loaded, and nobody has asked for it again. */
  private hasFailed = false;
  private isDisposed = false;

  constructor(private readonly options: Omit<SlicesOptions, "state">) {}

  follow(state: ViewerState): void {
    if (this.slices !== null) this.slices.follow(state);
    else if (isSliced(state) && !this.hasFailed) {
      this.wanted = state;
      this.coming ??= this.load();
    }
  }

  private async load(): Promise<void> {
    try {
      const { Slices } = await import("../slices/slices").catch((cause) => {
        throw new TemporaryError(NOT_LOADED, { cause });
      });
      if (this.isDisposed || this.wanted === null) return;
      this.slices = new Slices({ ...this.options, state: this.wanted });
      this.group.add(this.slices.planes.group);
      this.slices.follow(this.wanted);
      this.options.onChange();
    } catch (error) {
      this.hasFailed = true;
      this.options.onError(error);
    } finally {
      this.coming = null;
    }
  }

  get isLoading(): boolean {
    return this.coming !== null || this.slices?.images.isLoading === true;
  }

  /** What no depth knows of. */
  get overlays(): readonly Object3D[] {
    return this.slices === null ? [] : [this.slices.planes.marks];
  }

  /** Changes with what the planes hide; 0: nothing. */
  get solid(): number {
    return this.slices?.planes.solid ?? 0;
  }

  /** The pictures of the planes that stand in the scene; null: none do. */
  get standing() {
    return this.slices?.planes.group.visible ? this.slices.images : null;
  }

  /** What is gone before the planes for an eye, um, world: else it would hide them. */
  cornerTowards(eye: Vec3): readonly ClipPlane[] | undefined {
    return this.slices?.planes.cornerTowards(eye);
  }

  /** The channels' values where the slices meet, in the source's units; none: no slices show. */
  get values(): readonly string[] {
    const images = this.slices?.images ?? null;
    return images === null || images.frames === null ? [] : images.valuesAt(images.point);
  }

  update(sight: Sight): void {
    this.slices?.update(sight);
  }

  retryFailed(): void {
    this.hasFailed = false;
    this.slices?.images.retryFailed();
  }

  dispose(): void {
    this.isDisposed = true;
    this.slices?.dispose();
  }
}
