/** The panel as plain data: its own state, and its content for the present state of the viewer. */
import type { Manifest } from "../bundle/generated/bundle";
import type { Box } from "../math/box";
import { shownBox } from "../math/pick";
import { keepPlaces } from "../panel/channel_cards";
import {
  changePanel,
  type Layout,
  type PanelChange,
  type PanelView,
  type PartSection,
  START_VIEW,
} from "../panel/controls";
import { buildPanel, type Facts, MORE } from "../panel/layout";
import type { Ranges } from "../panel/window_texts";
import { unitOf } from "../probe/measure";
import { Signal } from "../state/signal";
import type { XrSupport } from "../state/stereo";
import type { ViewerState } from "../state/viewer_state";
import type { Snapshot } from "./snapshot";
import type { Undo } from "./undo";

/** The facts about the page and the browser that the panel shows. */
export type PageFacts = Readonly<{
  subtitle: string;
  stereo: XrSupport;
  /** Whether the browser reads QR codes. */
  canScan: boolean;
  /** Whether the specimen can stand in the user's own room. */
  hasRoom: boolean;
}>;

export type PanelSource = Readonly<{
  manifest: Manifest;
  state: ViewerState;
  undo: Undo;
  snapshot: () => Snapshot;
  sections: (view: PanelView) => readonly PartSection[];
}>;

/**
 * Returns whether a change of the panel gives cards to the channels that are shown now, and removes
 * the cards of all others.
 */
const renewsCards = (change: PanelChange) =>
  change.panel === "find" || (change.panel === "unfold" && change.section === "channels");

export class PanelModel {
  /** State of the panel in the page. A panel in the scene has its own. */
  view: PanelView = START_VIEW;
  /** By channel, the voxel values of the source that are 0 and 255 in a volume. */
  readonly ranges: Ranges;
  private readonly changed = new Signal<void>();
  private readonly shownByPage = new Signal<void>();
  private page: PageFacts = {
    ...{ subtitle: "", canScan: false, hasRoom: false },
    stereo: { isAvailable: false, reason: "" },
  };

  constructor(
    manifest: Manifest,
    private readonly source: () => PanelSource,
  ) {
    const unit = unitOf(manifest);
    this.ranges = new Map(manifest.channels.map(({ id, window }) => [id, [...window, unit]]));
  }

  /** Adds a listener for changes of the panel in the page. */
  onChange(listener: () => void): void {
    this.changed.subscribe(listener);
  }

  /** Makes the panel in the page show its content again. */
  refresh(): void {
    this.changed.emit();
  }

  /** Adds a listener that is called when the panel in the page shows the present state. */
  onShown(listener: () => void): void {
    this.shownByPage.subscribe(listener);
  }

  /** Called when the panel in the page shows the present state. */
  noteShown(): void {
    this.shownByPage.emit();
  }

  get facts(): PageFacts {
    return this.page;
  }

  /** Adds facts about the page and the browser. */
  addFacts(facts: Partial<PageFacts>): void {
    this.page = { ...this.page, ...facts };
    this.changed.emit();
  }

  change(change: PanelChange): void {
    this.view = changePanel(this.view, change);
    if (renewsCards(change)) this.view = { ...this.view, channelsWithCard: null };
    this.changed.emit();
  }

  /** Changes fields of the panel's state. */
  show(view: Partial<PanelView>): void {
    this.view = { ...this.view, ...view };
    this.changed.emit();
  }

  unfold(section: string): void {
    this.show({ open: [...new Set([...this.view.open, section, MORE])] });
  }

  /** Bounds of the specimen or the isolated tile, um, world. */
  get shown(): Box {
    const { manifest, state } = this.source();
    return shownBox(manifest, state.isolated);
  }

  /** Returns the content of the panel in the page. */
  buildPagePanel(): Layout {
    this.view = keepPlaces(this.view, this.source().state);
    return this.buildPanel(this.view);
  }

  /** Returns the content of a panel. A panel in the scene has its own open sections. */
  buildPanel(view: PanelView): Layout {
    const source = this.source();
    return buildPanel(source.state, this.factsFor(source), view, source.sections(view));
  }

  private factsFor(source: PanelSource): Facts {
    const { manifest, undo } = source;
    const now = source.snapshot();
    const { triangles, traced, isLoading, frame_ms, isStereo, settings } = now;
    const drawn = [...now.volumes, traced];
    const levels = drawn.flatMap(({ level }) => (level === null ? [] : [level]));
    return {
      title: manifest.specimen.name,
      subtitle: this.page.subtitle,
      shown: this.shown,
      isStereo,
      frame_ms: frame_ms > 0 ? frame_ms : null,
      settings,
      triangles,
      volumeLevel: levels.length > 0 ? Math.min(...levels) : null,
      samples: traced.level === null ? null : traced.samples,
      isLoading,
      undo: undo.undoes,
      redo: undo.redoes,
    };
  }
}
