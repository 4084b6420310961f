/** The part of the viewer that shows additions: arrows, labels, implants and electrodes from a layer over the stage. */
import { Group } from "three";
import { TemporaryError } from "../bundle/errors";
import type { FileRef } from "../bundle/generated/bundle";
import { NOT_LOADED } from "../host/later";
import type { Part, PartDefinition, PartHost, PartScene } from "../host/part";
import type { PartSection } from "../panel/controls";
import type { ViewerState } from "../state/viewer_state";
import type { LoadedAdditions } from "./load_additions";
import { ADDITION_KEYS, additionSections } from "./section";
import { ADDITION_SETTINGS } from "./settings";

class AdditionsPart implements Part {
  readonly id = "additions";
  private readonly group = new Group();
  private loaded: LoadedAdditions | null = null;
  private coming: Promise<void> | null = null;
  private isDisposed = false;

  constructor(private readonly host: PartHost) {}

  afterOpening(): void {
    const { additions } = this.host.bundle.manifest;
    if (additions === undefined || this.loaded !== null) return;
    const all = additions.layers.map(({ id }) => id);
    const hidden = this.host.state.hiddenAdditions;
    this.host.dispatch({ type: "hide-additions", hidden, all }, false);
    this.coming ??= this.load(additions.file);
  }

  private async load(file: FileRef): Promise<void> {
    const { bundle, display } = this.host;
    try {
      const { loadAdditions } = await import("./load_additions").catch((cause) => {
        throw new TemporaryError(NOT_LOADED, { cause });
      });
      const loaded = await loadAdditions(bundle.base, file);
      if (this.isDisposed) {
        loaded.dispose();
        return;
      }
      this.loaded = loaded;
      this.group.add(loaded.scene);
      this.sync(this.host.state);
    } catch (error) {
      this.host.report(error);
    } finally {
      this.coming = null;
      display.requestFrame();
    }
  }

  retryFailed(): void {
    this.afterOpening();
  }

  get isLoading(): boolean {
    return this.coming !== null;
  }

  sync({ hiddenAdditions }: ViewerState): void {
    for (const [id, object] of this.loaded?.byId ?? [])
      object.visible = !hiddenAdditions.includes(id);
  }

  get scene(): PartScene {
    const { group, loaded } = this;
    const isStanding = [...(loaded?.byId.values() ?? [])].some(({ visible }) => visible);
    return { group, overlays: loaded?.translucent ?? [], solid: 0, isStanding };
  }

  panel(): readonly PartSection[] {
    return additionSections(this.host.bundle.manifest, this.host.state);
  }

  dispose(): void {
    this.isDisposed = true;
    this.loaded?.dispose();
  }
}

export const additions: PartDefinition = {
  id: "additions",
  keys: ADDITION_KEYS,
  settings: ADDITION_SETTINGS,
  create: (host) => new AdditionsPart(host),
};
