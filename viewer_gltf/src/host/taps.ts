/** Choices in the view: a click or a tap, a key for the middle of the view, a hand or a gaze in stereo. */
import { Vector2 } from "three";
import { listenForClicks } from "../interaction/rays";
import { pickTile, shownTiles } from "../math/pick";
import type { Ray } from "../math/vec3";
import { chosenTile } from "../state/chosen_tile";
import { Signal } from "../state/signal";
import type { PartHost } from "./part";
import type { Parts } from "./parts";

const NOTHING_THERE = "There is nothing to fly to.";

export class Taps {
  /** Emitted after a double tap, which flies to the place. Its first tap was then not a choice. */
  readonly doubled = new Signal<void>();

  constructor(
    private readonly host: PartHost,
    private readonly parts: Parts,
    private readonly signal: AbortSignal,
  ) {
    const isFlat = () => !host.isInStereo;
    listenForClicks(
      host.canvas,
      (point) => {
        if (isFlat()) this.tap(this.rayAt(point));
      },
      (point) => {
        if (isFlat()) this.doubleTap(this.rayAt(point));
      },
    );
  }

  /**
   * Returns the ray (um) under a point of the screen, -1..1. In side-by-side stereo, the point is
   * in the image of one eye.
   */
  rayAt(point: Vector2): Ray {
    const { state, viewpoint } = this.host;
    if (state.screenStereo !== "side-by-side") return viewpoint.rayAt(point);
    return viewpoint.rayAt(new Vector2(2 * point.x + (point.x < 0 ? 1 : -1), point.y));
  }

  /** Taps the flat view: measures or selects what is hit. Returns whether anything was hit. */
  tap(ray: Ray, by: "pointer" | "key" = "pointer"): boolean {
    const { state, bundle } = this.host;
    const { tiles } = bundle.manifest;
    const tap = { ray, by, time_ms: performance.now() };
    this.parts.onTap(tap);
    const answer = this.parts.tap(tap);
    if (answer === "used") return true;
    const tile = pickTile(ray, shownTiles(tiles, state.isolated), state.clip)?.id ?? null;
    // a tap selects a tile only if the specimen has several tiles
    if (answer === null && tiles.length > 1 && tile !== null) {
      this.host.dispatch({ type: "select", tile });
    }
    this.parts.openCard(tap);
    return answer !== null || tile !== null;
  }

  /**
   * Measures in stereo, or chooses a tile if there are several. A choice by a resting gaze is not a
   * step of *Undo*, because it may be unintended.
   */
  choose(ray: Ray, tile: string | null, isByGaze: boolean): void {
    const { state } = this.host;
    const by = isByGaze ? "gaze" : "hand";
    if (this.parts.tap({ ray, by, time_ms: performance.now() }) !== null) return;
    if (state.isolated === null && tile !== null) {
      this.host.dispatch(chosenTile(state, tile), !isByGaze);
    }
  }

  private doubleTap(ray: Ray): void {
    this.doubled.emit();
    if (this.host.state.tool === "measure") this.tap(ray);
    else void this.flyAlong(ray);
  }

  /** Flies to the place that a ray (um) hits. If it hits nothing, the view stays, which is announced. */
  private async flyAlong(ray: Ray): Promise<void> {
    const { reading, undo, viewpoint } = this.host;
    const hit = await reading.probe(ray);
    if (this.signal.aborted) return;
    if (hit === null) {
      this.host.announce(NOTHING_THERE);
      return;
    }
    undo.noteCameraMove();
    viewpoint.flyTowards(hit.point);
  }
}
