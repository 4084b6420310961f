/** The objects of label maps, whose code comes with the first bundle that has one. */
import type { Object3D } from "three";
import { TemporaryError } from "../bundle/errors";
import type { Manifest } from "../bundle/generated/bundle";
import type { Box } from "../math/box";
import type { Ray, Vec3 } from "../math/vec3";
import type { Objects } from "../objects/objects";
import type { MetObject } from "../objects/pick";
import type { ObjectsFacts } from "../panel/layout";
import type { Action } from "../state/actions";
import type { ObjectView } from "../state/objects";
import type { ChannelState, ViewerState } from "../state/viewer_state";
import type { SurfaceSet } from "../surfaces/surface_set";

const NOT_LOADED =
  "The part of the page that shows objects could not be loaded. Check the connection and try again.";

export type ObjectsPartOptions = Readonly<{
  base: string;
  manifest: Manifest;
  surfaces: SurfaceSet;
  specimen: () => Object3D;
  dispatch: (action: Action, isStep?: boolean) => void;
  onAim: (box: Box, isSeen: (eye: Vec3) => boolean) => void;
  announce: (text: string) => void;
  /** A card has been opened, and not by a gaze: by the control that it begins with. */
  onCard: (control: string) => void;
  onChange: () => void;
  onError: (error: unknown) => void;
}>;

type Items = (
  objects: Objects,
  state: ViewerState,
  channel: string,
  isLast: boolean,
) => ObjectsFacts["items"];

/** An object that a ray meets; `distance`: in lengths of its direction. */
export type Met = MetObject & Readonly<{ channel: string }>;

export class ObjectsPart {
  /** By channel. */
  private readonly objects = new Map<string, Objects>();
  private readonly coming = new Set<string>();
  private readonly failed = new Set<string>();
  private layOut: Items = () => [];
  private state: ViewerState | null = null;

  constructor(private readonly options: ObjectsPartOptions) {
    options.surfaces.onSurface = (channel, { scene, tile, blend }) =>
      this.objects.get(channel)?.adopt(scene, tile, blend);
  }

  follow(state: ViewerState): void {
    this.state = state;
    for (const { id, shown } of state.channels) {
      const found = this.objects.get(id);
      if (found !== undefined) found.follow(state);
      else if (shown && !this.coming.has(id) && !this.failed.has(id)) void this.load(id);
    }
  }

  private async load(channel: string): Promise<void> {
    const { manifest, specimen, onChange, onError } = this.options;
    const file = manifest.channels.find(({ id }) => id === channel)?.objects;
    if (file === undefined) return;
    this.coming.add(channel);
    try {
      const [{ Objects }, { objectItems }] = await Promise.all([
        import("../objects/objects"),
        import("../panel/sections/objects"),
      ]).catch((cause) => {
        throw new TemporaryError(NOT_LOADED, { cause });
      });
      this.layOut = objectItems;
      const options = { ...this.options, specimen: specimen(), channel, file };
      this.objects.set(channel, await Objects.load(options));
      if (this.state !== null) this.follow(this.state);
    } catch (error) {
      this.failed.add(channel);
      onError(error);
    } finally {
      this.coming.delete(channel);
      onChange();
    }
  }

  get isLoading(): boolean {
    return this.coming.size > 0 || [...this.objects.values()].some(({ isLoading }) => isLoading);
  }

  private get shown(): readonly Readonly<{ channel: ChannelState; objects: Objects }>[] {
    return (this.state?.channels ?? []).flatMap((channel) => {
      const objects = channel.shown ? this.objects.get(channel.id) : undefined;
      return objects === undefined ? [] : [{ channel, objects }];
    });
  }

  /** The panel's sections, one of each label map that is shown. */
  get facts(): readonly ObjectsFacts[] {
    const { state, shown } = this;
    if (state === null) return [];
    return shown.map(({ channel, objects }, i) => ({
      id: channel.id,
      name: channel.name,
      colors: objects.colorsBeside(channel),
      items: this.layOut(objects, state, channel.id, i === shown.length - 1),
    }));
  }

  /** The nearest object along a ray, um; null: none. */
  meet(ray: Ray): Met | null {
    let best: Met | null = null;
    for (const [channel, objects] of this.objects) {
      const met = objects.meet(ray);
      if (met !== null && (best === null || met.distance < best.distance))
        best = { ...met, channel };
    }
    return best;
  }

  /** Open the card of the object along a ray, or close it where it is open; whether there is one. */
  choose(ray: Ray, isByGaze: boolean): boolean {
    const met = this.meet(ray);
    const objects = met && this.objects.get(met.channel);
    if (!met || !objects) return false;
    objects.pick(met.row, isByGaze);
    if (this.state?.objects[met.channel]?.picked === met.row) {
      this.options.announce(`Object ${objects.table.title(met.row)}`);
      if (!isByGaze) this.options.onCard(`${met.channel}/objects-card`);
    }
    return true;
  }

  /** The objects that are meant, as a table for each label map that is shown; null: it is on its way. */
  csv(): readonly Readonly<{ id: string; text: string | null }>[] {
    return this.shown.map(({ channel: { id }, objects }) => ({ id, text: objects.csv() }));
  }

  /** What the colours of a channel's objects mean; null: they have the stage's, or have not come. */
  legend(channel: string): Objects["legend"] {
    return this.objects.get(channel)?.legend ?? null;
  }

  /** What a link says of a channel's objects; null: their table has not come. */
  linked(channel: string, view: ObjectView): ReturnType<Objects["linked"]> | null {
    return this.objects.get(channel)?.linked(view) ?? null;
  }

  /** Rows of the objects that show, by channel that is shown. */
  get rowsShown(): ReadonlyMap<string, readonly number[]> {
    return new Map(this.shown.map(({ channel: { id }, objects }) => [id, objects.shown]));
  }

  /** How many objects of a channel show; null: their table has not come. */
  left(channel: string): number | null {
    return this.objects.get(channel)?.left ?? null;
  }

  /** The name of an object that a ray has met. */
  titleOf({ channel, row }: Met): string {
    return this.objects.get(channel)?.table.title(row) ?? "";
  }

  /** The number of the object along a ray in its label map; null: there is none. */
  labelAlong(ray: Ray): Readonly<{ channel: string; label: string }> | null {
    const met = this.meet(ray);
    const label = met && this.objects.get(met.channel)?.table.label(met.row);
    return met && label ? { channel: met.channel, label } : null;
  }

  retryFailed(): void {
    this.failed.clear();
    for (const each of this.objects.values()) each.retryFailed();
  }

  dispose(): void {
    for (const each of this.objects.values()) each.dispose();
  }
}
