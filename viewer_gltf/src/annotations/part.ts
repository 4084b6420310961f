/** The part of the viewer for handles, measurements, scale bar, orientation axes and names. */
import { fileName, saveFile } from "../dom/save_file";
import type {
  FrameView,
  Part,
  PartDefinition,
  PartHost,
  PartScene,
  Tap,
  TapAnswer,
} from "../host/part";
import type { HandleLights, MeasuredPoints } from "../host/services";
import type { Target } from "../interaction/ray_pointer";
import type { HandleId } from "../marks/clip_handles";
import { lampHandles } from "../marks/lamp_handles";
import type { PartSection } from "../panel/controls";
import { allOf, measurementsCsv } from "../state/measurements";
import { REFUSED } from "../state/refusals";
import type { ViewerState } from "../state/viewer_state";
import "./annotations.css";
import { Marks } from "./annotations";
import { listenForHandles } from "./handle_pointer";
import { MEASURE_COMMANDS, MEASURE_KEYS, measureSections } from "./section";

class AnnotationsPart implements Part, HandleLights, MeasuredPoints {
  readonly id = "annotations";
  readonly services = { handles: this, measured: this };
  readonly pageCommands = { "save-csv": () => this.saveMeasurements() };
  readonly targets: readonly Target[];
  private readonly marks: Marks;
  private readonly disposed = new AbortController();

  constructor(private readonly host: PartHost) {
    const { bundle, stage, display } = host;
    const options = {
      manifest: bundle.manifest,
      reading: host.reading,
      surfaces: () => host.service("surfaces")?.meshes ?? [],
      dispatch: host.dispatch.bind(host),
      announce: host.announce.bind(host),
      onChange: () => display.requestFrame(),
    };
    const marks = new Marks(options, host.state);
    this.marks = marks;
    this.targets = [marks.target];
    stage.append(...marks.overlayElements);
    listenForHandles(
      stage,
      host.canvas,
      {
        pick: (point, pointing) =>
          host.isInStereo ? null : marks.pick(host.rayAt(point), pointing),
        drag: (id, point) => marks.drag(id, host.rayAt(point)),
        highlight: (id) => marks.highlight(id),
      },
      this.disposed.signal,
    );
  }

  get scene(): PartScene {
    const { group, overlays } = this.marks;
    return { group, overlays, solid: 0, isStanding: false };
  }

  sync(state: ViewerState, previous: ViewerState): void {
    this.marks.sync(state);
    const lamps = this.lampsOf(state);
    if (lamps.length > this.lampsOf(previous).length && !this.host.isInStereo) {
      // new lamps may lie beside or behind the camera; in stereo the user turns the head to find them
      this.host.viewpoint.stepBackFor(lamps.map(({ position }) => position));
    }
  }

  private lampsOf(state: ViewerState) {
    return lampHandles(state, this.host.bundle.manifest.specimen.bounds_um);
  }

  advance(frame: FrameView): void {
    this.marks.update(frame);
  }

  /** Sets a measured point if measuring is the chosen tool. */
  tap({ ray }: Tap): TapAnswer {
    if (this.host.state.tool !== "measure") return null;
    void this.marks.measure(ray);
    return "used";
  }

  panel(): readonly PartSection[] {
    return measureSections(this.host.state, this.values);
  }

  get values(): MeasuredPoints["values"] {
    return this.marks.values;
  }

  highlight(handle: HandleId | null): void {
    this.marks.highlight(handle);
  }

  private saveMeasurements(): void {
    const { state, bundle } = this.host;
    const list = allOf(state);
    if (list.length === 0) {
      this.host.announce(REFUSED.measured);
      return;
    }
    const name = fileName(bundle.manifest.specimen.name, "measurements", "csv");
    saveFile(name, new Blob([measurementsCsv(list)], { type: "text/csv" }));
    this.host.announce(`Saved: ${name}`);
  }

  retryFailed(): void {
    this.marks.rereadValues();
  }

  dispose(): void {
    this.disposed.abort();
    this.marks.dispose();
  }
}

export const annotations: PartDefinition = {
  id: "annotations",
  keys: MEASURE_KEYS,
  commands: MEASURE_COMMANDS,
  create: (host) => new AnnotationsPart(host),
};
