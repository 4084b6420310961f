/** Choices in the picture: a click or a tap, a key in the middle of the view, a hand or a gaze in stereo. */
import { Vector2 } from "three";
import { listenForClicks } from "../interaction/rays";
import { pickTile, shownTiles } from "../math/pick";
import type { Ray } from "../math/vec3";
import { chosenTile } from "../state/chosen_tile";
import { Signal } from "../state/signal";
import type { PartHost } from "./part";
import type { Parts } from "./parts";

const NOTHING_THERE = "Nothing lies there to fly to.";

export class Taps {
  /** A second quick tap asks to fly there, so the first one was no choice. */
  readonly doubled = new Signal<void>();

  constructor(
    private readonly host: PartHost,
    private readonly parts: Parts,
    private readonly signal: AbortSignal,
  ) {
    const isFlat = () => !host.isInRoom;
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

  /** The ray (um) under a point of the screen, -1..1, in the picture of the eye that shows there. */
  rayAt(point: Vector2): Ray {
    const { state, viewpoint } = this.host;
    if (state.screenStereo !== "side-by-side") return viewpoint.rayAt(point);
    return viewpoint.rayAt(new Vector2(2 * point.x + (point.x < 0 ? 1 : -1), point.y));
  }

  /** A tap on the flat picture: measures, or selects what lies there. Returns whether it met anything. */
  tap(ray: Ray, by: "pointer" | "key" = "pointer"): boolean {
    const { state, bundle } = this.host;
    const { tiles } = bundle.manifest;
    const tap = { ray, by, time_ms: performance.now() };
    this.parts.hearTap(tap);
    const answer = this.parts.tap(tap);
    if (answer === "used") return true;
    const tile = pickTile(ray, shownTiles(tiles, state.isolated), state.clip)?.id ?? null;
    // a single tile has no others to be told apart from
    if (answer === null && tiles.length > 1 && tile !== null) {
      this.host.dispatch({ type: "select", tile });
    }
    this.parts.openCard(tap);
    return answer !== null || tile !== null;
  }

  /**
   * In stereo this measures, or chooses the tile; a specimen of a single tile has nothing to choose. A choice by a
   * resting gaze is no step that *Undo* takes back, since nobody asked for it.
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

  /** Flies to the place that a ray (um) meets. Where it meets nothing the view stays, and the page says so. */
  private async flyAlong(ray: Ray): Promise<void> {
    const { reading, undo, viewpoint } = this.host;
    const met = await reading.probe(ray);
    if (this.signal.aborted) return;
    if (met === null) {
      this.host.announce(NOTHING_THERE);
      return;
    }
    undo.noteLook();
    viewpoint.flyTowards(met.point);
  }
}
