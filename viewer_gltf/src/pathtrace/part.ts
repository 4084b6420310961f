/** The part of the viewer that draws volumes by path tracing. Most of its code loads when path tracing first begins. */
import { chooseFile } from "../dom/choose_file";
import type { Form } from "../host/form";
import type { Part, PartDefinition, PartHost } from "../host/part";
import type { PanelView, PartSection } from "../panel/controls";
import { setTo } from "../state/parameters/kinds";
import { ENVIRONMENT } from "../state/parameters/light";
import type { ViewerState } from "../state/viewer_state";
import { LIGHT_KEYS } from "./keys";
import { lightSections } from "./section";
import { TracedVolume } from "./traced_volume";

class PathTracePart implements Part, Form {
  readonly id = "pathtrace";
  readonly form = this;
  readonly pageCommands = { "own-light": () => void this.lightByFile() };
  /** The traced volume; null: there are no volumes to trace. */
  private readonly volume: TracedVolume | null;

  constructor(private readonly host: PartHost) {
    const volumes = host.service("volumes");
    const texels = host.service("texels");
    if (volumes === null || texels === null) {
      this.volume = null;
      return;
    }
    const { sceneDepth } = host.frame;
    const { base, manifest } = host.bundle;
    const image = manifest.lights?.room?.image;
    const stageEnvironment = image === undefined ? null : { base, file: image };
    const onChange = () => host.display.requestFrame();
    const onError = (error: unknown) => host.report(error);
    const { bricks, limits } = texels;
    this.volume = new TracedVolume(
      volumes,
      bricks,
      limits,
      sceneDepth,
      stageEnvironment,
      onChange,
      onError,
    );
    host.frame.add(this.volume.group);
  }

  get traced(): TracedVolume | undefined {
    return this.volume ?? undefined;
  }

  sync(state: ViewerState): void {
    this.volume?.sync(state);
  }

  panel(view: PanelView): readonly PartSection[] {
    const { state, isInStereo } = this.host;
    return lightSections(state, view, isInStereo);
  }

  get isLoading(): boolean {
    return this.volume?.isLoading ?? false;
  }

  limitEdge(edge: number): void {
    this.volume?.limitEdge(edge);
  }

  forget(): void {
    this.volume?.forget();
  }

  /** Shows newly loaded bricks, which appear at once and never fade in. */
  fade(fade_s: number): boolean {
    this.volume?.advance(fade_s);
    return false;
  }

  retryFailed(): void {
    this.volume?.retryFailed();
  }

  /** Lets the user choose a file, and lights the scene by it. */
  private async lightByFile(): Promise<void> {
    const file = await chooseFile(".hdr,.exr");
    if (file === null || this.volume === null) return;
    try {
      await this.volume.lightBy(file);
      this.host.dispatch(setTo(ENVIRONMENT, "own"));
      this.host.announce(`Lit by ${file.name}`);
    } catch (error) {
      this.host.report(error);
    }
  }

  dispose(): void {
    this.volume?.dispose();
  }
}

export const pathTrace: PartDefinition = {
  id: "pathtrace",
  rank: 20,
  keys: LIGHT_KEYS,
  canTrace: (gl) => gl.getExtension("EXT_color_buffer_float") !== null,
  create: (host) => new PathTracePart(host),
};
