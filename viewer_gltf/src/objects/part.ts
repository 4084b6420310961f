/** The part of the viewer for the objects of label maps. Most of its code loads when a label map is first shown. */
import { TemporaryError } from "../bundle/errors";
import { fileName, saveFile } from "../dom/save_file";
import type { Hit, Part, PartDefinition, PartHost, Tap, TapAnswer } from "../host/part";
import type { ObjectMaps } from "../host/services";
import { along, type Ray } from "../math/vec3";
import type { PartSection, Section } from "../panel/controls";
import type { ObjectView } from "../state/objects";
import type { ChannelState, ViewerState } from "../state/viewer_state";
import { labelMapSections, OBJECT_COMMANDS, OBJECT_KEYS } from "./label_maps";
import type { Objects } from "./objects";

const NOT_LOADED =
  "The part of the page that shows objects could not be loaded. Check the connection and try again.";
const BEHIND_OTHERS =
  "Other objects hide this object from all sides. Its card has a button that shows it alone.";
const NO_OBJECTS = "There are no objects to save, because no label map is shown.";
const STILL_LOADING = "The values of the objects are still loading. Save them again in a moment.";

type MakeItems = (
  objects: Objects,
  state: ViewerState,
  channel: string,
  isLast: boolean,
) => Section["items"];

class ObjectsPart implements Part, ObjectMaps {
  readonly id = "objects";
  readonly services = { objects: this };
  readonly pageCommands = { "save-objects": () => this.save() };
  /** The loaded label maps, by channel ID. */
  private readonly objects = new Map<string, Objects>();
  private readonly coming = new Set<string>();
  private readonly failed = new Set<string>();
  private makeItems: MakeItems = () => [];

  constructor(private readonly host: PartHost) {
    host
      .service("surfaces")
      ?.onLoaded((channel, { scene, tile, blend }) =>
        this.objects.get(channel)?.adopt(scene, tile, blend),
      );
  }

  sync(state: ViewerState): void {
    for (const { id, shown } of state.channels) {
      const found = this.objects.get(id);
      if (found !== undefined) found.sync(state);
      else if (shown && !this.coming.has(id) && !this.failed.has(id)) void this.load(id);
      if (this.host.state !== state) return; // this call changed the state, which has synced all label maps again
    }
  }

  private async load(channel: string): Promise<void> {
    const { bundle, display } = this.host;
    const file = bundle.manifest.channels.find(({ id }) => id === channel)?.objects;
    if (file === undefined) return;
    this.coming.add(channel);
    try {
      const [{ Objects }, { objectItems }] = await Promise.all([
        import("./objects"),
        import("./section"),
      ]).catch((cause) => {
        throw new TemporaryError(NOT_LOADED, { cause });
      });
      this.makeItems = objectItems;
      this.objects.set(channel, await Objects.load({ ...this.options, channel, file }));
      this.sync(this.host.state);
    } catch (error) {
      this.failed.add(channel);
      this.host.report(error);
    } finally {
      this.coming.delete(channel);
      display.requestFrame();
    }
  }

  private get options(): Omit<Parameters<typeof Objects.load>[0], "channel" | "file"> {
    const { bundle, display, viewpoint, specimen } = this.host;
    const surfaces = this.host.service("surfaces");
    return {
      ...{ base: bundle.base, manifest: bundle.manifest, surfaces },
      specimen,
      dispatch: (change, isStep) => this.host.dispatch(change, isStep),
      onAim: (box, isSeen) => {
        const isFree = viewpoint.flyTo(box, isSeen);
        if (!isFree) this.host.announce(BEHIND_OTHERS);
      },
      onChange: () => display.requestFrame(),
      onError: (error) => this.host.report(error),
    };
  }

  get isLoading(): boolean {
    return this.coming.size > 0 || [...this.objects.values()].some(({ isLoading }) => isLoading);
  }

  private get shown(): readonly Readonly<{ channel: ChannelState; objects: Objects }>[] {
    return this.host.state.channels.flatMap((channel) => {
      const objects = channel.shown ? this.objects.get(channel.id) : undefined;
      return objects === undefined ? [] : [{ channel, objects }];
    });
  }

  panel(): readonly PartSection[] {
    const { state, isInStereo } = this.host;
    const { shown } = this;
    const items = shown.map(({ channel: { id }, objects }, i) => {
      const isLast = i === shown.length - 1;
      return [id, this.makeItems(objects, state, id, isLast)] as const;
    });
    return labelMapSections(state, new Map(items), isInStereo);
  }

  pick(ray: Ray): Hit | null {
    const length_um = Math.hypot(...ray.direction);
    const hits = [...this.objects].flatMap(([channel, objects]): Hit[] => {
      const found = objects.hit(ray);
      if (found === null) return [];
      const { row, tile, distance } = found;
      const point = along(ray.origin, ray.direction, distance);
      const object = { row, name: objects.table.title(row), label: objects.table.label(row) };
      return [{ point, tile, channel, distance_um: distance * length_um, object }];
    });
    return hits.toSorted((a, b) => a.distance_um - b.distance_um)[0] ?? null;
  }

  /** Opens the card of the object along a ray, or closes it if it is open. */
  tap({ ray, by }: Tap): TapAnswer {
    const hit = this.pick(ray);
    const objects = this.objects.get(hit?.channel ?? "");
    if (hit?.object === undefined || objects === undefined) return null;
    const { channel, object } = hit;
    objects.pick(object.row, by === "gaze");
    if (channel !== null && this.host.state.objects[channel]?.picked === object.row) {
      this.host.announce(`Object ${object.name}`);
      if (by !== "gaze" && !this.host.isInStereo) {
        this.host.revealed.emit(`${channel}/objects-card`);
      }
    }
    return "shared";
  }

  /** Saves a CSV file for each shown label map. */
  private save(): void {
    const { shown, host } = this;
    if (shown.length === 0) host.announce(NO_OBJECTS);
    for (const { channel, objects } of shown) {
      const text = objects.csv();
      if (text === null) {
        host.announce(STILL_LOADING);
        continue;
      }
      const what = shown.length === 1 ? "objects" : `objects-${channel.id}`;
      const name = fileName(host.bundle.manifest.specimen.name, what, "csv");
      saveFile(name, new Blob([text], { type: "text/csv" }));
      host.announce(`Saved: ${name}`);
    }
  }

  legend(channel: string): Objects["legend"] {
    return this.objects.get(channel)?.legend ?? null;
  }

  get colors(): ReadonlyMap<string, readonly string[]> {
    const colors = this.shown.map(
      ({ channel, objects }) => [channel.id, objects.colorsBeside(channel)] as const,
    );
    return new Map(colors);
  }

  linked(channel: string, view: ObjectView): ReturnType<Objects["linked"]> | null {
    return this.objects.get(channel)?.linked(view) ?? null;
  }

  get rowsShown(): ReadonlyMap<string, readonly number[]> {
    return new Map(this.shown.map(({ channel: { id }, objects }) => [id, objects.shown]));
  }

  shownCount(channel: string): number | null {
    return this.objects.get(channel)?.shownCount ?? null;
  }

  retryFailed(): void {
    this.failed.clear();
    for (const each of this.objects.values()) each.retryFailed();
  }

  dispose(): void {
    for (const each of this.objects.values()) each.dispose();
  }
}

export const objects: PartDefinition = {
  id: "objects",
  keys: OBJECT_KEYS,
  commands: OBJECT_COMMANDS,
  create: (host) => new ObjectsPart(host),
};
