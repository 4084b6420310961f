/** The part of the viewer that saves images and videos, and keeps the views that a video passes through. */
import { fileName, saveFile } from "../dom/save_file";
import type { Part, PartDefinition, PartHost } from "../host/part";
import type { PosterMaker } from "../host/services";
import type { PartSection } from "../panel/controls";
import { REFUSED } from "../state/refusals";
import type { Scene } from "./save_picture";
import { SAVE_COMMANDS, SAVE_KEYS, saveSections } from "./section";
import { CAPTURE_SETTINGS } from "./settings";
import { stageViews } from "./stage_views";

const ON_THE_SCREEN = "Pictures and videos can only be saved on a flat screen. Leave stereo first.";
const NEXT_KEPT = "“Next kept view” shows one after the other.";
const ONLY_VIEW = "That is the only kept view.";

/** A file that was made; null if the user has cancelled it. */
type Made = Readonly<{ suffix: string; content: Blob }> | null;

/** Loads the code that draws and writes files. Rejects with a DOMException. */
function loadSaving() {
  return import("./save_picture").catch((cause) => {
    throw new DOMException(
      `the part of the page that saves pictures and videos could not be loaded (${cause})`,
      "NetworkError",
    );
  });
}

class CapturePart implements Part, PosterMaker {
  readonly id = "capture";
  readonly services = { posters: this };
  readonly commands = {
    "keep-view": () => this.keep(),
    "next-view": () => this.goToNext(),
    "forget-views": () => this.forget(),
  };
  readonly pageCommands = {
    "save-picture": () => void this.save("picture", (signal) => this.makePicture(signal)),
    "save-video": () => void this.save("video", (signal) => this.makeVideo(signal)),
  };
  /** Cancels the image or video that is being made; null if none is. */
  private filming: AbortController | null = null;
  /** Index of the saved view that is shown next. */
  private nextView = 0;

  constructor(private readonly host: PartHost) {}

  /** Keeps the views of the stage's cameras, unless the address contains saved views. */
  afterOpening(): void {
    const { state, bundle } = this.host;
    const views = stageViews(bundle.manifest);
    if (state.keptViews.length > 0 || views.length === 0) return;
    this.host.dispatch({ type: "keep-views", views }, false);
  }

  panel(): readonly PartSection[] {
    return saveSections(this.host.state, this.filming !== null, this.nextView);
  }

  async poster(longest_px: number): Promise<Blob> {
    const { posterOf } = await loadSaving();
    return posterOf(this.filmed, longest_px);
  }

  private get filmed(): Scene {
    const { stage, state, bundle, display, viewpoint, specimen } = this.host;
    const { renderer, studio } = display;
    return {
      renderer,
      navigation: viewpoint.navigation,
      studio,
      height_px: stage.clientHeight,
      specimen: viewpoint.specimen,
      labelled: specimen,
      state,
      manifest: bundle.manifest,
      colorsOf: (channel) => this.host.service("objects")?.legend(channel) ?? null,
    };
  }

  /** Makes an image of the view in the chosen size. */
  private async makePicture(signal: AbortSignal): Promise<Made> {
    const { savePicture } = await loadSaving();
    const scale = Number(this.host.state.pictureSize);
    const say = (words: string) => this.host.announce(`Picture: ${words}`);
    const content = await savePicture(this.filmed, scale, say, signal);
    return content && { suffix: "png", content };
  }

  /** Makes a video through the kept views, or once around the specimen. */
  private async makeVideo(signal: AbortSignal): Promise<Made> {
    const { saveVideo } = await loadSaving();
    const { viewpoint } = this.host;
    const before = viewpoint.cameraView;
    const say = (done: number, of: number) => this.host.announce(`Video: ${done} of ${of}`);
    try {
      return await saveVideo(this.filmed, this.host.state.keptViews, say, signal);
    } finally {
      viewpoint.restore(before);
    }
  }

  /** Makes a file and saves it for the user. A second call while a file is being made cancels that file. */
  private async save(
    what: "picture" | "video",
    make: (signal: AbortSignal) => Promise<Made>,
  ): Promise<void> {
    const { host } = this;
    if (host.isInStereo) {
      host.announce(ON_THE_SCREEN);
      return;
    }
    if (this.filming !== null) {
      this.filming.abort();
      return;
    }
    this.filming = new AbortController();
    const { signal } = this.filming;
    host.panel.refresh();
    try {
      const made = await make(signal);
      const doing = what === "picture" ? "Saving the picture" : "Making the video";
      if (made === null) host.announce(`${doing} was cancelled.`);
      else {
        const name = fileName(host.bundle.manifest.specimen.name, what, made.suffix);
        saveFile(name, made.content);
        host.announce(`Saved: ${name}`);
      }
    } catch (error) {
      if (!(error instanceof DOMException)) throw error;
      const done = what === "picture" ? "saved" : "made";
      host.announce(`The ${what} can't be ${done}: ${error.message}.`);
    } finally {
      this.filming = null;
      host.panel.refresh();
    }
  }

  private keep(): boolean {
    const { state, isInStereo, viewpoint } = this.host;
    if (isInStereo) return false;
    this.setViews([...state.keptViews, viewpoint.cameraPose]);
    return true;
  }

  private forget(): boolean {
    if (this.host.isInStereo) return false;
    this.setViews([]);
    return true;
  }

  private setViews(views: PartHost["state"]["keptViews"]): void {
    this.nextView = 0;
    this.host.dispatch({ type: "keep-views", views });
    const { length } = this.host.state.keptViews;
    this.host.announce(
      length === 0
        ? "All kept views were removed."
        : `Number of kept views: ${length}. ${NEXT_KEPT}`,
    );
  }

  private goToNext(): boolean {
    const { state, isInStereo, undo, viewpoint } = this.host;
    const { keptViews } = state;
    if (isInStereo || keptViews.length === 0) return false;
    undo.noteCameraMove();
    const before = viewpoint.cameraPose;
    const { name, ...look } = keptViews[this.nextView++ % keptViews.length];
    viewpoint.lookFlatFrom(look);
    if (name !== undefined) this.host.announce(`View: ${name}`);
    this.host.panel.refresh(); // the button now names the following view
    if (viewpoint.isAt(before)) this.host.announce(ONLY_VIEW);
    return true;
  }

  dispose(): void {
    this.filming?.abort();
  }
}

export const capture: PartDefinition = {
  id: "capture",
  keys: SAVE_KEYS,
  commands: SAVE_COMMANDS,
  settings: CAPTURE_SETTINGS,
  remedies: { [REFUSED.views]: () => ({ label: "Keep this view", to: ["keep-view"] }) },
  create: (host) => new CapturePart(host),
};
