/**
 * The panel in the page: shows the content of the panel's model, and carries out the requests of
 * controls and keys.
 */
import { toggleFullScreen } from "../dom/full_screen";
import type { Part, PartDefinition, PartHost } from "../host/part";
import type { PagePanel } from "../host/services";
import type { Refusal, Request } from "../panel/controls";
import { Panel } from "../panel/html/panel";
import { withKeys } from "../panel/keys";
import { pixelShare } from "../render/pixel_share";
import { Keyboard } from "./keyboard";
import { Overlays } from "./overlays";
import { rememberChange, rememberedView } from "./remembered";

/** Milliseconds between updates of the figures that change with each frame. */
const REFRESH_MS = 250;
const FEWER_PIXELS = "The view has fewer pixels until this tab is closed.";
const NO_FULL_SCREEN = "This browser can't show this page in full screen.";

class PagePart implements Part, PagePanel {
  readonly id = "page";
  readonly services = { page: this };
  readonly pageCommands = {
    undo: () => this.keyboard.undo(),
    find: () => this.find(),
    "full-screen": () => void this.toggleFullScreen(),
  };
  private readonly html: Panel;
  private readonly overlays: Overlays;
  private readonly keyboard: Keyboard;
  private readonly disposed = new AbortController();
  private timer = 0;

  constructor(private readonly host: PartHost) {
    const { signal } = this.disposed;
    const parent = host.view.parentElement ?? host.view;
    this.overlays = new Overlays(host, this, signal);
    this.html = new Panel((request) => this.perform(request));
    parent.append(this.html.root);
    this.keyboard = new Keyboard(host, this, parent, signal);
    host.announced.subscribe((text) => this.showAnnouncement(text));
    host.revealed.subscribe((control) => this.html.reveal(control));
    host.changed.subscribe(() => this.refresh());
    host.panel.onChange(() => this.refresh());
    host.drawn.subscribe(() => this.refreshSoon());
    // the user has opened a link to the same bundle; a reload resets all settings that the link
    // does not contain
    addEventListener("hashchange", () => location.reload(), { signal });
    host.canvas.addEventListener("webglcontextlost", () => {
      void import("./lost_context").then(({ offerReload }) =>
        offerReload(host, () => host.service("links")?.writeAddress()),
      );
    });
  }

  begin(): void {
    this.host.panel.show(rememberedView());
  }

  afterOpening(): Promise<void> {
    this.overlays.begin();
    return this.overlays.offerWaysIn();
  }

  afterOverview(): void {
    if (pixelShare() < 1) this.showAnnouncement(FEWER_PIXELS);
  }

  private refresh(): void {
    clearTimeout(this.timer);
    this.timer = 0;
    const { panel } = this.host;
    this.html.update(panel.buildPagePanel());
    if (this.keyboard.update()) this.overlays.announcement.withdraw();
    panel.noteShown();
  }

  /** Updates the figures to the newest frame from time to time. */
  private refreshSoon(): void {
    if (this.timer === 0) this.timer = window.setTimeout(() => this.refresh(), REFRESH_MS);
  }

  perform(request: Request | Refusal): void {
    const { host } = this;
    if (typeof request === "string") host.run(request);
    else if ("refusal" in request) void this.explain(request);
    else if ("panel" in request) {
      if (request.panel === "hide" && host.stereo.togglePanel()) return;
      host.panel.change(request);
      rememberChange(request, host.panel.view);
      if (request.panel === "reveal") this.html.reveal(request.control);
    } else host.dispatch(request);
  }

  focus(section: string, control: string): boolean {
    const { panel } = this.host;
    panel.show({ isHidden: false });
    panel.unfold(section);
    return this.html.focus(control);
  }

  showAnnouncement(words: string): void {
    this.overlays.announcement.show(words);
  }

  offer(words: string, label: string, act: () => void): void {
    this.overlays.announcement.offer(words, label, act);
  }

  /** Announces why a request has no effect now, with a button if the refusal has one. */
  private async explain({ refusal }: Refusal): Promise<void> {
    const { host } = this;
    const words = withKeys(refusal, host.panel.view.keyChanges);
    host.announce(words);
    if (host.isInStereo) return;
    const button = (await host.service("messages")?.buttonFor(refusal)) ?? null;
    if (button !== null) this.offer(words, button.label, button.act);
  }

  private find(): void {
    const isLong = this.focus("channels", "find-channel");
    if (!isLong) this.host.announce("The panel lists all channels.");
  }

  private async toggleFullScreen(): Promise<void> {
    const isDone = await toggleFullScreen();
    if (!isDone) this.host.announce(NO_FULL_SCREEN);
  }

  dispose(): void {
    clearTimeout(this.timer);
    this.disposed.abort();
    this.html.root.remove();
    this.keyboard.dispose();
  }
}

export const page: PartDefinition = {
  id: "page",
  create: (host) => new PagePart(host),
};
