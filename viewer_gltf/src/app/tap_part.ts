/** A tap on the flat picture opens a card beside the place. The card follows the place as the view turns. */
import { Vector3 } from "three";
import { pickTile, shownTiles } from "../math/pick";
import { along, type Ray, type Vec3 } from "../math/vec3";
import { TapCard } from "../panel/html/tap_card";
import type { Send } from "../panel/html/widget";
import { type Tapped, tapCardOf } from "../panel/tap_card";
import type { Viewer } from "./viewer";

/** Time after a tap in which another one makes a double click of the two, ms: see interaction/rays.ts. */
const DOUBLE_MS = 400;

/** A tap on the picture: its ray in um, and when it came on the page's clock. */
export type Tap = Readonly<{ ray: Ray; isByKey: boolean; time_ms: number }>;

export class TapPart {
  private readonly card: TapCard;
  private shown: (Tapped & Readonly<{ point: Vec3 }>) | null = null;
  /** Counts the taps, so that only the newest one opens the card. */
  private taps = 0;

  constructor(
    private readonly viewer: Viewer,
    view: HTMLElement,
    send: Send,
  ) {
    this.card = new TapCard(view, send, () => this.close());
  }

  /** Open the card of what a tap meets, unless it was the first of a double click. */
  async open({ ray, isByKey, time_ms }: Tap): Promise<void> {
    const number = ++this.taps;
    const tapped = await this.meet(ray);
    // the card of another place goes at once
    if (number === this.taps) this.hide();
    const rest_ms = isByKey ? 0 : time_ms + DOUBLE_MS - performance.now();
    await new Promise((resolve) => setTimeout(resolve, Math.max(0, rest_ms)));
    const { viewer } = this;
    if (number !== this.taps || tapped === null || viewer.stereo.kind !== null) return;
    this.shown = tapped;
    const place = this.placeOf(tapped.point);
    if (place === null) this.shown = null;
    else this.card.open(tapCardOf(viewer.state, tapped, viewer.undoes), place, isByKey);
  }

  /** Close the card, and leave one that is about to open closed. */
  close(): void {
    this.taps++;
    this.hide();
  }

  private hide(): void {
    this.shown = null;
    this.card.close();
  }

  /** Follow a change of the state. */
  update(): void {
    const { viewer, shown } = this;
    if (shown === null) return;
    if (viewer.state.tool === "measure" || viewer.stereo.kind !== null) this.close();
    else this.card.update(tapCardOf(viewer.state, shown, viewer.undoes));
  }

  /** Follow the view, after every frame. */
  follow(): void {
    if (this.shown === null) return;
    const place = this.viewer.stereo.kind === null ? this.placeOf(this.shown.point) : null;
    if (place === null) this.close();
    else this.card.moveTo(place);
  }

  /** The nearest object, surface, volume or slice along a ray, else the tile; null: the ray meets nothing. */
  private async meet(ray: Ray): Promise<(Tapped & { point: Vec3 }) | null> {
    const { contents, state, bundle } = this.viewer;
    const met = await contents.marks.probe(ray);
    const object = contents.objects.meet(ray);
    const isOfObjects = (id: string | null) =>
      state.channels.some((each) => each.id === id && each.hasObjects);
    // the probe also meets the triangles of objects that are hidden
    const other = met !== null && isOfObjects(met.channel) ? null : met;
    const length_um = Math.hypot(...ray.direction);
    if (object !== null && !(other && other.distance_um < object.distance * length_um)) {
      const { tile, channel, row } = object;
      const name = contents.objects.titleOf(object);
      return {
        point: along(ray.origin, ray.direction, object.distance),
        tile,
        channel,
        object: { row, name },
      };
    }
    if (other !== null) return { point: other.point, tile: other.tile, channel: other.channel };
    const tiles = shownTiles(bundle.manifest.tiles, state.isolated);
    const inTile = pickTile(ray, tiles, state.clip);
    if (inTile === null || bundle.manifest.tiles.length < 2) return null;
    return {
      point: along(ray.origin, ray.direction, inTile.distance),
      tile: inTile.id,
      channel: null,
    };
  }

  /** px from the upper left of the picture; null: out of the picture. */
  private placeOf(point: Vec3): Readonly<{ x: number; y: number }> | null {
    const { navigation, specimen, renderer } = this.viewer;
    const { clientWidth, clientHeight } = renderer.domElement;
    const at = new Vector3(...point).applyMatrix4(specimen).project(navigation.camera);
    if (Math.max(Math.abs(at.x), Math.abs(at.y), Math.abs(at.z)) > 1) return null;
    return { x: ((at.x + 1) / 2) * clientWidth, y: ((1 - at.y) / 2) * clientHeight };
  }

  dispose(): void {
    this.close();
    this.card.dispose();
  }
}
