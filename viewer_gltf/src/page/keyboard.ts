/** The keys of the page. The effect of each key is announced, and can be taken back. */
import { NOT_LOADED } from "../host/later";
import type { PartHost } from "../host/part";
import type { PagePanel } from "../host/services";
import type { Mark } from "../host/undo";
import { handleOf } from "../panel/clip_by_key";
import type { PanelView, Request } from "../panel/controls";
import type { Help } from "../panel/html/key_list";
import { isRefusal, type KeyContext } from "../panel/key";
import { isWritten, listenForKeys } from "../panel/key_events";
import { spokenFeedback } from "../panel/spoken_feedback";
import { announcementOf } from "../state/announce_change";

/** The moment and the state of the panel before a key was pressed; *Undo* returns to them. */
type Before = Readonly<{ mark: Mark; view: PanelView }>;
const HIDDEN: Readonly<Record<string, string>> = {
  true: "The panel is hidden.",
  false: "The panel is shown.",
};

export class Keyboard {
  /** The list of keys; null: not opened yet. */
  private help: Help | null = null;
  /** The last change by a key that can still be taken back, with the newest step after it. */
  private accident: (Before & Readonly<{ after: object | null }>) | null = null;

  constructor(
    private readonly host: PartHost,
    private readonly page: PagePanel,
    private readonly parent: HTMLElement,
    signal: AbortSignal,
  ) {
    host.announced.subscribe(() => {
      this.accident = null;
    });
    // an inert page is being prepared behind the shown one, and must not react to keys
    listenForKeys((name) => !parent.inert && this.press(name), signal);
  }

  /** Takes back the change by the last key; returns false if there is none. */
  undo(): boolean {
    if (this.accident === null) return false;
    this.takeBack(this.accident);
    return true;
  }

  /** Updates the list of keys. Returns whether the last change can no longer be taken back. */
  update(): boolean {
    const { isHelpOpen, keyChanges } = this.host.panel.view;
    this.help?.update(isHelpOpen, keyChanges);
    if (isHelpOpen && this.help === null) void this.loadHelp();
    if (this.accident === null || this.accident.after === this.host.undo.newest) return false;
    this.accident = null;
    return true;
  }

  private press(pressed: string): boolean {
    const { host } = this;
    const { view } = host.panel;
    if (!view.hasLetters && isWritten(pressed) && pressed !== "?") return false;
    if (pressed === "Escape" && view.isHelpOpen && this.help === null) {
      this.page.perform({ panel: "help" }); // the list of keys is still being loaded
      return true;
    }
    const name = host.keys.standsFor(pressed, view.keyChanges);
    const request = name === null ? null : host.keys.requestOf(name, this.context);
    if (name === null || request === null) {
      if (isWritten(pressed))
        host.announce(`${pressed} is not a key of the viewer: ? lists the keys.`);
      return false;
    }
    if (isRefusal(request)) {
      this.page.perform(request);
      return false;
    }
    this.grant(request, name, isWritten(pressed));
    return true;
  }

  private get context(): KeyContext {
    const { state, panel, display } = this.host;
    const { view, shown } = panel;
    return { state, view, shown, focusTile: display.snapshot().gazed };
  }

  private grant(request: Request, name: string, canBeAccident: boolean): void {
    const { host } = this;
    const before = host.state;
    const { mark } = host.undo;
    const { view, ranges } = host.panel;
    this.page.perform(request);
    if (typeof request !== "string" && "panel" in request && request.panel === "clip-part") {
      host.service("handles")?.highlight(handleOf(request.clipPart));
    }
    const { tiles } = host.bundle.manifest;
    const text =
      announcementOf(before, host.state, tiles) ??
      spokenFeedback(request, before, host.state, ranges);
    const words = text || host.keys.labelOf(name);
    if (canBeAccident && this.offerBack(request, words, { mark, view })) return;
    if (text !== "") host.announce(text);
  }

  /** Announces the change by a key, and offers to take it back, since it may have been an accident. */
  private offerBack(request: Request, text: string, { mark, view }: Before): boolean {
    const { host } = this;
    const now = host.panel.view;
    const isOwnAnswer = request === "share" || now.isHelpOpen || host.isInStereo;
    if (isOwnAnswer || !(host.undo.hasChangedSince(mark) || view !== now)) return false;
    const words = view.isHidden === now.isHidden ? text : HIDDEN[String(now.isHidden)];
    const accident = { mark, view, after: host.undo.newest };
    host.announce(words);
    this.page.offer(words, "Undo", () => this.takeBack(accident));
    this.accident = accident;
    return true;
  }

  private takeBack({ mark, view }: Before): void {
    this.accident = null;
    this.host.undo.takeBack(mark);
    this.host.panel.show(view);
    this.host.announce("Undone.");
  }

  private async loadHelp(): Promise<void> {
    const { host } = this;
    const part = await import("../panel/html/key_list").catch(() => null);
    if (part === null) {
      host.panel.show({ isHelpOpen: false });
      host.announce(NOT_LOADED);
      return;
    }
    this.help ??= new part.Help(
      this.parent,
      host.keys,
      () => {
        if (host.panel.view.isHelpOpen) this.page.perform({ panel: "help" });
      },
      (changes) => this.page.perform({ panel: "keys", changes }),
    );
    host.panel.refresh();
  }

  dispose(): void {
    this.help?.dispose();
  }
}
