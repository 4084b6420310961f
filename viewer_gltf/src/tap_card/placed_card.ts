/** The card of a tapped place, which follows the place as the view turns. */
import type { Hit, PartHost, Tap } from "../host/part";
import { pickTile, shownTiles } from "../math/pick";
import { along, type Ray, type Vec3 } from "../math/vec3";
import { TapCard } from "../panel/html/tap_card";
import type { Send } from "../panel/html/widget";
import { type Tapped, tapCardOf } from "../panel/tap_card";

/** Milliseconds in which a second tap makes a double click (see interaction/rays.ts). */
const DOUBLE_MS = 400;

type Place = Tapped & Readonly<{ point: Vec3 }>;

export class PlacedCard {
  private readonly card: TapCard;
  private shown: Place | null = null;
  /** Number of taps so far; only the newest one opens the card. */
  private taps = 0;

  constructor(
    private readonly host: PartHost,
    send: Send,
  ) {
    this.card = new TapCard(host.view, send, () => this.close());
  }

  /** Opens the card of the place that a tap hits, unless the tap was the first of a double click. */
  async open({ ray, by, time_ms }: Tap): Promise<void> {
    const number = ++this.taps;
    const isByKey = by === "key";
    const tapped = await this.find(ray);
    // a card that is open beside an earlier tapped point closes at once
    if (number === this.taps) this.hide();
    const rest_ms = isByKey ? 0 : time_ms + DOUBLE_MS - performance.now();
    await new Promise((resolve) => setTimeout(resolve, Math.max(0, rest_ms)));
    const { host } = this;
    if (number !== this.taps || tapped === null || host.isInStereo) return;
    this.shown = tapped;
    const place = this.placeOf(tapped.point);
    if (place === null) this.shown = null;
    else this.card.open(tapCardOf(host.state, tapped, host.undo.undoes), place, isByKey);
  }

  /** Closes the card, and cancels one that is about to open. */
  close(): void {
    this.taps++;
    this.hide();
  }

  private hide(): void {
    this.shown = null;
    this.card.close();
  }

  /** Updates the card to the state. */
  update(): void {
    const { host, shown } = this;
    if (shown === null) return;
    if (host.state.tool === "measure" || host.isInStereo) this.close();
    else this.card.update(tapCardOf(host.state, shown, host.undo.undoes));
  }

  /** Moves the card with the view, after every frame. */
  sync(): void {
    if (this.shown === null) return;
    const place = this.host.isInStereo ? null : this.placeOf(this.shown.point);
    if (place === null) this.close();
    else this.card.moveTo(place);
  }

  /**
   * Returns the nearest object, surface, volume or slice along a ray, else the tile; null: nothing
   * is hit.
   */
  private async find(ray: Ray): Promise<Place | null> {
    const { state, reading } = this.host;
    const hit = await reading.probe(ray);
    const object = this.host.objectAlong(ray);
    const isOfObjects = (id: string | null) =>
      state.channels.some((each) => each.id === id && each.hasObjects);
    // the probe also hits the triangles of hidden objects
    const other = hit !== null && isOfObjects(hit.channel) ? null : hit;
    if (object !== null && !(other && other.distance_um < object.distance_um)) {
      return placeOfHit(object);
    }
    return other === null ? this.tileAlong(ray) : placeOfHit(other);
  }

  /** Returns the tile along a ray if there are several tiles; null: none. */
  private tileAlong(ray: Ray): Place | null {
    const { state, bundle } = this.host;
    const { tiles } = bundle.manifest;
    const hit = pickTile(ray, shownTiles(tiles, state.isolated), state.clip);
    if (hit === null || tiles.length < 2) return null;
    const point = along(ray.origin, ray.direction, hit.distance);
    return { point, tile: hit.id, channel: null };
  }

  /** Returns the place in px from the upper left of the view; null: outside the view. */
  private placeOf(point: Vec3): Readonly<{ x: number; y: number }> | null {
    const { canvas, viewpoint } = this.host;
    const { clientWidth, clientHeight } = canvas;
    const at = viewpoint.project(point);
    if (Math.max(Math.abs(at.x), Math.abs(at.y), Math.abs(at.z)) > 1) return null;
    return { x: ((at.x + 1) / 2) * clientWidth, y: ((1 - at.y) / 2) * clientHeight };
  }

  dispose(): void {
    this.close();
    this.card.dispose();
  }
}

function placeOfHit({ point, tile, channel, object }: Hit): Place {
  return { point, tile, channel, ...(object && { object }) };
}
