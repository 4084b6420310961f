/** The card of a tapped place, which follows the place as the view turns. */
import type { Hit, PartHost, Tap } from "../host/part";
import { pickTile, shownTiles } from "../math/pick";
import { along, type Ray, type Vec3 } from "../math/vec3";
import { TapCard } from "../panel/html/tap_card";
import type { Send } from "../panel/html/widget";
import { type Tapped, tapCardOf } from "../panel/tap_card";

/** Time after a tap in which another one makes a double click of the two, ms: see interaction/rays.ts. */
const DOUBLE_MS = 400;

type Place = Tapped & Readonly<{ point: Vec3 }>;

export class PlacedCard {
  private readonly card: TapCard;
  private shown: Place | null = null;
  /** Counts the taps, so that only the newest one opens the card. */
  private taps = 0;

  constructor(
    private readonly host: PartHost,
    send: Send,
  ) {
    this.card = new TapCard(host.view, send, () => this.close());
  }

  /** Opens the card of the place that a tap meets, unless the tap was the first of a double click. */
  async open({ ray, by, time_ms }: Tap): Promise<void> {
    const number = ++this.taps;
    const isByKey = by === "key";
    const tapped = await this.meet(ray);
    // the card of another place goes at once
    if (number === this.taps) this.hide();
    const rest_ms = isByKey ? 0 : time_ms + DOUBLE_MS - performance.now();
    await new Promise((resolve) => setTimeout(resolve, Math.max(0, rest_ms)));
    const { host } = this;
    if (number !== this.taps || tapped === null || host.isInRoom) return;
    this.shown = tapped;
    const place = this.placeOf(tapped.point);
    if (place === null) this.shown = null;
    else this.card.open(tapCardOf(host.state, tapped, host.undo.undoes), place, isByKey);
  }

  /** Closes the card, and leaves one that is about to open closed. */
  close(): void {
    this.taps++;
    this.hide();
  }

  private hide(): void {
    this.shown = null;
    this.card.close();
  }

  /** Follows a change of the state. */
  update(): void {
    const { host, shown } = this;
    if (shown === null) return;
    if (host.state.tool === "measure" || host.isInRoom) this.close();
    else this.card.update(tapCardOf(host.state, shown, host.undo.undoes));
  }

  /** Follows the view, after every frame. */
  follow(): void {
    if (this.shown === null) return;
    const place = this.host.isInRoom ? null : this.placeOf(this.shown.point);
    if (place === null) this.close();
    else this.card.moveTo(place);
  }

  /** The nearest object, surface, volume or slice along a ray, else the tile; null: the ray meets nothing. */
  private async meet(ray: Ray): Promise<Place | null> {
    const { state, reading } = this.host;
    const met = await reading.probe(ray);
    const object = this.host.objectAlong(ray);
    const isOfObjects = (id: string | null) =>
      state.channels.some((each) => each.id === id && each.hasObjects);
    // the probe also meets the triangles of objects that are hidden
    const other = met !== null && isOfObjects(met.channel) ? null : met;
    if (object !== null && !(other && other.distance_um < object.distance_um)) {
      return placeOfHit(object);
    }
    return other === null ? this.tileAlong(ray) : placeOfHit(other);
  }

  /** The tile along a ray, where there are several; null: there is none. */
  private tileAlong(ray: Ray): Place | null {
    const { state, bundle } = this.host;
    const { tiles } = bundle.manifest;
    const met = pickTile(ray, shownTiles(tiles, state.isolated), state.clip);
    if (met === null || tiles.length < 2) return null;
    const point = along(ray.origin, ray.direction, met.distance);
    return { point, tile: met.id, channel: null };
  }

  /** px from the upper left of the picture; null: out of the picture. */
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
