/**
 * What the user works the viewer by: panel, keys, list of keys, share link. Holds the panel's own
 * view and turns wishes into actions and commands; code that draws the panel elsewhere takes
 * `layOut` and hands its wishes to `perform`.
 */

import { hasAddress, pageAddress } from "../bundle/address";
import { chooseFile } from "../dom/choose_file";
import { copyText } from "../dom/clipboard";
import { toggleFullScreen } from "../dom/full_screen";
import { fileName, saveFile } from "../dom/save_file";
import { store, stored } from "../dom/stored";
import type { Box } from "../math/box";
import { shownBox } from "../math/pick";
import type { Ray } from "../math/vec3";
import { handleOf } from "../panel/clip_by_key";
import {
  changePanel,
  type Layout,
  type Lenses,
  type PanelChange,
  type PanelView,
  type Refusal,
  START_VIEW,
  type Wish,
} from "../panel/controls";
import type { CardMeasure } from "../panel/html/card_measure";
import type { Help } from "../panel/html/key_list";
import type { Said } from "../panel/html/overlays";
import { Panel } from "../panel/html/panel";
import { isRefusal, type KeyContext } from "../panel/key";
import { isWritten, listenForKeys } from "../panel/key_events";
import { type KeyChanges, labelOf, standsFor, wishOf, withKeys } from "../panel/keys";
import { type Facts, layOut, MORE } from "../panel/layout";
import { keepPlaces, type Ranges } from "../panel/sections/channels";
import { spokenFeedback } from "../panel/spoken_feedback";
import { unitOf } from "../probe/measure";
import { isPassingStep, withTyped, writeAddress } from "../share/address";
import { SETTINGS, settingsOf, standOf } from "../share/page_parameters";
import { readLink, writeLink } from "../share/permalink";
import type { Action } from "../state/actions";
import { announcementOf } from "../state/announce_change";
import { CANT, type Command } from "../state/commands";
import { initialState } from "../state/initial_state";
import { allOf, measurementsCsv } from "../state/measurements";
import { setTo } from "../state/parameters/kinds";
import { EYE_DISTANCE, START_TOOLS, STEREO_STRENGTH } from "../state/parameters/tools";
import { SWITCH_DISTANCE } from "../state/parameters/volumes";
import { REFUSED } from "../state/refusals";
import { PER_INCH, type XrSupport } from "../state/stereo";
import type { ViewerState } from "../state/viewer_state";
import { cssPixelsPerInch } from "../xr/cardboard/lens";
import { canScan, scanCode } from "../xr/cardboard/scan_qr";
import {
  BUILT_IN,
  faultOfCode,
  type Profile,
  ProfileError,
  parseProfile,
} from "../xr/cardboard/viewer_profile";
import type { TapPart } from "./tap_part";
import type { ViewMessagePart } from "./view_message_part";
import type { Mark, Viewer } from "./viewer";

/** Stereo on a phone counts as available: the start itself reports what the phone lacks. */
const SPLIT: XrSupport = { isAvailable: true, reason: "" };
/** Time between updates of the figures that change with each frame, ms. */
const REFRESH_MS = 250;

const NOT_COME = "This part of the page could not be loaded: check the connection and try again.";
const NO_ROOM = "This browser can't show things in your room (WebXR's immersive-ar).";
const NO_FULL_SCREEN = "This browser shows the page on no full screen.";
const ON_THE_SCREEN = "Pictures and videos are of the flat screen: leave stereo to save them.";

const LENS_KEY = "stereocell-lens";
/** Whether a change gives the cards to the channels that are shown by then. */
const laysOutCards = (change: PanelChange) =>
  change.panel === "find" || (change.panel === "unfold" && change.section === "channels");
const EYE_ROWS = [EYE_DISTANCE, STEREO_STRENGTH] as const;

/** The user's phone viewer, from the visit before. */
function rememberedLens(): Partial<Pick<PanelView, "lenses" | "code">> {
  try {
    const { lenses, code } = JSON.parse(stored(LENS_KEY) ?? "{}");
    const isKnown = lenses === "own" || lenses in BUILT_IN;
    return isKnown && typeof code === "string" ? { lenses, code } : {};
  } catch {
    return {}; // another program has written other words there
  }
}

const OPEN_KEY = "stereocell-open";
const LETTERS_KEY = "stereocell-letters";
const KEYS_KEY = "stereocell-keys";

/** The keys that the reader has changed on a visit before. */
function rememberedKeys(): KeyChanges {
  try {
    const found: unknown = JSON.parse(stored(KEYS_KEY) ?? "{}");
    const pairs = Object.entries(found ?? {}).filter((pair) => typeof pair[1] === "string");
    return Object.fromEntries(pairs);
  } catch {
    return {}; // another program's words: then as at first
  }
}

/**
 * The sections of the panel that the reader had open on the visit before, but for those of label maps: the rows below
 * would move when a table has come.
 */
function rememberedOpen(): readonly string[] {
  const text = stored(OPEN_KEY);
  const sections = text === null ? START_VIEW.open : text.split(" ");
  return sections.filter((id) => !id.startsWith("objects"));
}

const SCREEN_KEY = "stereocell-screen";
const EYES_KEY = "stereocell-eyes";

/** CSS pixels in an inch of this screen, as it was measured; null: it was not. */
function rememberedScreen(): number | null {
  const [least, most] = PER_INCH;
  const perInch = Number(stored(SCREEN_KEY));
  return perInch >= least && perInch <= most ? perInch : null;
}

/** What the user has set for the eyes, on a visit before. */
function rememberedEyes(): readonly Action[] {
  const texts = (stored(EYES_KEY) ?? "").split(",");
  return EYE_ROWS.flatMap((row, i) => {
    const value = Number(texts[i] || Number.NaN);
    return Number.isFinite(value) ? [setTo(row, value)] : [];
  });
}

/** Parts of the state that can leave the picture empty. */
const EMPTYING = ["channels", "clip", "isolated", "selected", "objects"] as const;

/** Whether the picture may be empty by what was set: then the part of the page that says why is loaded. */
const mayBeEmpty = (state: ViewerState, opening: ViewerState) =>
  EMPTYING.some((key) => state[key] !== opening[key]) ||
  (state.mode === "off" && !state.channels.some(({ shown, hasSurface }) => shown && hasSurface));

/** The step and the panel's view before a key was pressed; *Undo* returns to them. */
type Before = Readonly<{ mark: Mark; view: PanelView }>;
const HIDDEN: Readonly<Record<string, string>> = {
  true: "The panel is hidden.",
  false: "The panel is shown.",
};

export type ControllerOptions = Readonly<{
  subtitle: string;
  /** Enter stereo; called from within a click or a key, as is the other. */
  onStereo: () => void;
  /** Enter the user's own room. */
  onRoom: () => void;
  /** Split the screen for a phone viewer of such lenses. */
  onSplit: (lenses: Profile) => void;
}>;

export class Controller {
  readonly panel: Panel;
  private view: PanelView = {
    ...START_VIEW,
    ...rememberedLens(),
    open: rememberedOpen(),
    hasLetters: stored(LETTERS_KEY) !== "off",
    keyChanges: rememberedKeys(),
  };
  private stereo: XrSupport = { isAvailable: false, reason: "" };
  /** The list of keys, and below it the card measure: null until each is first opened. */
  private help: Help | null = null;
  private card: CardMeasure | null = null;
  /** The card beside a tapped place, once something was tapped. */
  private tapped: TapPart | null = null;
  /** Number of taps so far. If another tap has come while the card's code loaded, the first one opens no card. */
  private taps = 0;
  /** Messages over the picture; null until the first one is due and their part of the page has loaded. */
  private message: ViewMessagePart | null = null;
  /** The state in which the bundle opened. */
  private readonly opening: ViewerState;
  private readonly ranges: Ranges;
  private readonly disposed = new AbortController();
  private timer = 0;
  /** As they were when they were last remembered. */
  private eyes = EYE_ROWS.map((row) => row.get(START_TOOLS)).join();
  private canScan = false;
  private hasRoom = false;
  /** While a picture or a video is made. */
  private filming: AbortController | null = null;
  /** The change by a key that can still be taken back, with the newest step after it. */
  private accident: (Before & Readonly<{ after: object | null }>) | null = null;

  constructor(
    private readonly viewer: Viewer,
    private readonly parent: HTMLElement,
    private readonly said: Said,
    private readonly options: ControllerOptions,
  ) {
    const { manifest } = viewer.bundle;
    const unit = unitOf(manifest);
    this.opening = viewer.state;
    this.ranges = new Map(manifest.channels.map(({ id, window }) => [id, [...window, unit]]));
    this.panel = new Panel((wish) => this.perform(wish));
    parent.append(this.panel.root);
    viewer.setScreen(rememberedScreen());
    for (const action of rememberedEyes()) viewer.dispatch(action);
    viewer.onAnnounce = (text) => this.say(text);
    viewer.onCard = (control) => this.panel.reveal(control);
    viewer.onSelect = (ray, isByKey) => void this.openTapCard(ray, isByKey);
    viewer.onDouble = () => {
      this.taps++;
      this.tapped?.close();
    };
    viewer.onCommand = (command) => {
      if (command === "share") void this.share();
      return command === "share";
    };
    viewer.onLenses = (lenses) => this.changeLenses(lenses);
    listenForKeys((name) => this.press(name), this.disposed.signal);
    // A link to another view of the same bundle: what it leaves out is as the bundle opens.
    addEventListener("hashchange", () => location.reload(), { signal: this.disposed.signal });
    this.refresh();
    void canScan().then((isAble) => {
      this.canScan = isAble;
      this.refresh();
    });
  }

  /** What a panel shows now; one that is drawn elsewhere has its own sections open. */
  layOut(view: PanelView = this.view): Layout {
    return layOut(this.viewer.state, this.factsFor(view), view);
  }

  /** @param hasRoom whether the specimen can stand in the user's own room */
  setStereo(support: XrSupport, hasRoom: boolean): void {
    this.stereo = support;
    this.hasRoom = hasRoom;
    this.refresh();
  }

  /** Bring the panel to the state; to be called after each change. */
  refresh(): void {
    clearTimeout(this.timer);
    this.timer = 0;
    this.view = keepPlaces(this.view, this.viewer.state);
    this.panel.update(this.layOut());
    const eyes = EYE_ROWS.map((row) => row.get(this.viewer.state)).join();
    if (eyes !== this.eyes) store(EYES_KEY, eyes);
    this.eyes = eyes;
    this.help?.update(this.view.isHelpOpen, this.view.keyChanges);
    if (this.view.isHelpOpen && this.help === null) void this.loadHelp();
    if (this.accident !== null && this.accident.after !== this.viewer.newestStep) {
      this.accident = null;
      this.said.withdraw();
    }
    this.tapped?.update();
    if (mayBeEmpty(this.viewer.state, this.opening)) void this.loadMessage();
    this.message?.update();
  }

  /** Bring the card beside a place to the frame that was just drawn, and the figures now and then. */
  refreshSoon(): void {
    this.tapped?.follow();
    if (this.timer === 0) this.timer = window.setTimeout(() => this.refresh(), REFRESH_MS);
  }

  perform(wish: Wish | Refusal): void {
    if (typeof wish === "string") this.run(wish);
    else if ("refusal" in wish) void this.explain(wish);
    else if ("panel" in wish) {
      if (wish.panel === "hide" && this.viewer.stereo.togglePanel()) return;
      this.view = changePanel(this.view, wish);
      if (laysOutCards(wish)) this.view = { ...this.view, channelsWithCard: null };
      if (wish.panel === "unfold") store(OPEN_KEY, this.view.open.join(" "));
      if (wish.panel === "letters") store(LETTERS_KEY, wish.areOn ? "on" : "off");
      if (wish.panel === "keys") store(KEYS_KEY, JSON.stringify(wish.changes));
      this.refresh();
      if (wish.panel === "reveal") this.panel.reveal(wish.control);
    } else this.viewer.dispatch(wish);
  }

  /** Go to what the page's address asks for. */
  followAddress(search: string, hash: string): void {
    const { viewer } = this;
    const { bounds_um } = viewer.bundle.manifest.specimen;
    const { actions, camera } = readLink(withTyped(hash), viewer.state, bounds_um);
    const asked = [...settingsOf(search), ...actions];
    for (const action of asked) viewer.dispatch(action);
    const saysDistance = asked.some((a) => a.type === "set" && a.id === SWITCH_DISTANCE.id);
    const stand = standOf(search); // what `reset` returns to, wherever a link looks from
    if (camera === null || stand !== null) viewer.openWith(stand, saysDistance);
    if (camera !== null) viewer.lookFrom(camera);
    this.view = { ...this.view, channelsWithCard: null };
    viewer.forgetSteps();
  }

  private run(command: Command): void {
    if (command === "undo" && this.accident !== null) this.takeBack(this.accident);
    else if (command === "share") void this.share();
    else if (command === "stereo") {
      if (this.viewer.stereo.kind !== null) this.viewer.stereo.end();
      else if (this.stereo.isAvailable) this.options.onStereo();
      else this.say(this.stereo.reason);
    } else if (command === "room") {
      if (this.viewer.stereo.kind !== null) this.viewer.stereo.end();
      else if (this.hasRoom) this.options.onRoom();
      else this.say(NO_ROOM);
    } else if (command === "full-screen") {
      void toggleFullScreen().then((isDone) => isDone || this.say(NO_FULL_SCREEN));
    } else if (command === "split") {
      this.splitScreen();
    } else if (command === "scan") {
      void this.scan();
    } else if (command === "measure-screen") {
      void this.measureScreen();
    } else if (command === "own-light") {
      void this.lightByFile();
    } else if (command === "save-picture") {
      void this.savePicture();
    } else if (command === "save-video") {
      void this.saveVideo();
    } else if (command === "save-csv") {
      this.saveMeasurements();
    } else if (command === "save-objects") {
      this.saveObjects();
    } else if (command === "find") {
      const isLong = this.goTo("channels", "find-channel");
      if (!isLong) this.say("The panel lists all channels.");
    } else if (!this.viewer.run(command)) this.say(CANT);
  }

  /** On the page, and in stereo before the eyes, which don't see the page. */
  private say(text: string): void {
    this.accident = null;
    this.said.say(text);
    this.viewer.stereo.announce(text);
  }

  private unfold(section: string): void {
    this.view = { ...this.view, open: [...new Set([...this.view.open, section, MORE])] };
    this.refresh();
  }

  /** Bring the keyboard to a control, also of a panel that is hidden; whether there is one. */
  private goTo(section: string, control: string): boolean {
    this.view = { ...this.view, isHidden: false };
    this.unfold(section);
    return this.panel.focus(control);
  }

  private splitScreen(): void {
    const { lenses, code } = this.view;
    this.viewer.stereo.showInPanel({ lenses, code });
    this.withProfile((profile) => this.options.onSplit(profile));
  }

  /** In stereo: the phone is in another viewer. */
  private changeLenses(lenses: Lenses): void {
    this.perform({ panel: "lenses", lenses });
    this.withProfile((profile) => this.viewer.stereo.setLenses(profile));
  }

  private withProfile(use: (profile: Profile) => void): void {
    const { lenses, code } = this.view;
    try {
      use(lenses === "own" ? parseProfile(code) : BUILT_IN[lenses]);
      store(LENS_KEY, JSON.stringify({ lenses, code }));
    } catch (error) {
      if (!(error instanceof ProfileError)) throw error;
      this.say(error.message);
    }
  }

  private async measureScreen(): Promise<void> {
    const { viewer, parent } = this;
    const part = await import("../panel/html/card_measure").catch(() => null);
    if (part === null) {
      this.say(NOT_COME);
      return;
    }
    this.card ??= new part.CardMeasure(parent, (perInch) => {
      store(SCREEN_KEY, String(perInch));
      viewer.setScreen(perInch);
      this.say(
        `The screen has ${perInch} pixels an inch: split the screen to see it in true size.`,
      );
    });
    const { userAgent } = navigator;
    this.card.open(viewer.cssPixelsPerInch ?? cssPixelsPerInch(userAgent, devicePixelRatio));
  }

  private get pictureArea(): HTMLElement {
    return this.parent.querySelector<HTMLElement>(".view") ?? this.parent;
  }

  /** Say why a request does nothing now, with a button where something leads on. */
  private async explain({ refusal }: Refusal): Promise<void> {
    const words = withKeys(refusal, this.view.keyChanges);
    this.say(words);
    if (this.viewer.stereo.kind !== null) return;
    const button = (await this.loadMessage())?.buttonFor(refusal, this.shown) ?? null;
    if (button !== null) this.said.offer(words, button.label, button.act);
  }

  private async loadMessage(): Promise<ViewMessagePart | null> {
    if (this.message !== null) return this.message;
    const part = await import("./view_message_part").catch(() => null);
    if (part === null || this.message !== null) return this.message;
    const refresh = () => this.message?.update();
    this.message = new part.ViewMessagePart(this.viewer, this.pictureArea, this.opening, refresh);
    refresh();
    return this.message;
  }

  private async openTapCard(ray: Ray, isByKey: boolean): Promise<void> {
    const time_ms = performance.now();
    const number = ++this.taps;
    const part = await import("./tap_part").catch(() => null);
    if (number !== this.taps) return;
    if (part === null) {
      this.say(NOT_COME);
      return;
    }
    this.tapped ??= new part.TapPart(this.viewer, this.pictureArea, (wish) => this.perform(wish));
    await this.tapped.open({ ray, isByKey, time_ms });
  }

  private async scan(): Promise<void> {
    const scanner = await import("../panel/html/qr_scanner").catch(() => null);
    if (scanner === null) {
      this.say(NOT_COME);
      return;
    }
    const { scanByCamera } = scanner;
    try {
      const text = await scanByCamera(document.body, scanCode);
      if (text !== null) this.perform({ panel: "code", text });
    } catch (error) {
      if (!(error instanceof ProfileError || error instanceof DOMException)) throw error;
      this.say(error.message);
    }
  }

  /** Light the traced picture by a file of the user's. */
  private async lightByFile(): Promise<void> {
    const file = await chooseFile(".hdr,.exr");
    if (file === null) return;
    try {
      await this.viewer.lightBy(file);
      this.say(`Lit by ${file.name}`);
    } catch (error) {
      this.viewer.report(error);
    }
  }

  private press(pressed: string): boolean {
    const { viewer, view } = this;
    if (!view.hasLetters && isWritten(pressed) && pressed !== "?") return false;
    if (pressed === "Escape" && view.isHelpOpen && this.help === null) {
      this.perform({ panel: "help" }); // the list of keys is still being loaded
      return true;
    }
    const name = standsFor(pressed, view.keyChanges);
    const mark = viewer.mark;
    const context: KeyContext = {
      state: viewer.state,
      view,
      shown: this.shown,
      focusTile: viewer.snapshot().gazed,
    };
    const wish = name === null ? null : wishOf(name, context);
    if (name === null || wish === null || isRefusal(wish)) {
      if (wish !== null && isRefusal(wish)) void this.explain(wish);
      else if (isWritten(pressed)) this.say(`No key ${pressed}: ? lists the keys.`);
      return false;
    }
    this.perform(wish);
    if (typeof wish !== "string" && "panel" in wish && wish.panel === "clip-part") {
      viewer.mean(handleOf(wish.clipPart));
    }
    const { tiles } = viewer.bundle.manifest;
    const text =
      announcementOf(context.state, viewer.state, tiles) ??
      spokenFeedback(wish, context.state, viewer.state, this.ranges);
    if (!isWritten(pressed) || !this.offerBack(wish, text || labelOf(name), { mark, view })) {
      if (text !== "") this.say(text);
    }
    return true;
  }

  /** Announce what a key has changed, and offer to take it back: it may have been hit by accident. */
  private offerBack(wish: Wish, text: string, { mark, view }: Before): boolean {
    const { viewer } = this;
    const isOwnAnswer = wish === "share" || this.view.isHelpOpen || viewer.stereo.kind !== null;
    if (isOwnAnswer || !(viewer.hasChangedSince(mark) || view !== this.view)) return false;
    const words = view.isHidden === this.view.isHidden ? text : HIDDEN[String(this.view.isHidden)];
    const accident = { mark, view, after: viewer.newestStep };
    this.say(words);
    this.said.offer(words, "Undo", () => this.takeBack(accident));
    this.accident = accident;
    return true;
  }

  private takeBack({ mark, view }: Before): void {
    this.accident = null;
    this.viewer.takeBack(mark);
    this.view = view;
    this.refresh();
    this.say("Undone.");
  }

  private async loadHelp(): Promise<void> {
    const part = await import("../panel/html/key_list").catch(() => null);
    if (part === null) {
      this.view = { ...this.view, isHelpOpen: false };
      this.say(NOT_COME);
      return;
    }
    this.help ??= new part.Help(
      this.parent,
      () => {
        if (this.view.isHelpOpen) this.perform({ panel: "help" });
      },
      (changes) => this.perform({ panel: "keys", changes }),
    );
    this.refresh();
  }

  /** The address of this view, in the clipboard, in the address bar and in the panel. */
  private async share(): Promise<void> {
    const { viewer } = this;
    const address = new URL(pageAddress());
    for (const name of SETTINGS) address.searchParams.delete(name);
    const start = initialState(viewer.bundle.manifest);
    address.hash = writeLink(viewer.state, start, viewer.cameraView, viewer.linkedObjects);
    // the address follows the view once the split screen is left
    if (hasAddress() && !isPassingStep()) writeAddress(address);
    this.view = { ...this.view, link: address.href };
    this.unfold("share");
    viewer.stereo.showInPanel({ link: address.href });
    const without = viewer.leftOutOfLink;
    const but =
      without === 0
        ? ""
        : ` It leaves out lists of ${without} objects, which are too long: save them as CSV.`;
    if (viewer.stereo.kind !== null) {
      this.say(`The link is in the page's address, for when you leave.${but}`);
    } else if (await copyText(address.href)) this.say(`The link is in the clipboard.${but}`);
    else {
      this.goTo("share", "link"); // which selects it
      this.say(`Here is the link, selected: copy it by Ctrl+C, or by a long press.${but}`);
    }
  }

  private async savePicture(): Promise<void> {
    const { viewer } = this;
    if (viewer.stereo.kind !== null) {
      this.say(ON_THE_SCREEN);
      return;
    }
    if (this.filming !== null) {
      this.filming.abort(); // asked for once more: it is left
      return;
    }
    this.filming = new AbortController();
    const { signal } = this.filming;
    this.refresh();
    try {
      const size = Number(viewer.state.pictureSize);
      const png = await viewer.picture(size, (words) => this.say(`Picture: ${words}`), signal);
      if (png === null) this.say("Saving the picture was cancelled.");
      else this.save("picture", "png", png);
    } catch (error) {
      this.refuse("The picture can't be saved", error);
    } finally {
      this.filming = null;
      this.refresh();
    }
  }

  private async saveVideo(): Promise<void> {
    const { viewer } = this;
    if (viewer.stereo.kind !== null) {
      this.say(ON_THE_SCREEN);
      return;
    }
    if (this.filming !== null) {
      this.filming.abort(); // asked for once more: it is left
      return;
    }
    this.filming = new AbortController();
    const { signal } = this.filming;
    this.refresh();
    try {
      const file = await viewer.film((done, of) => this.say(`Video: ${done} of ${of}`), signal);
      if (file === null) this.say("Making the video was cancelled.");
      else this.save("video", file.suffix, file.content);
    } catch (error) {
      this.refuse("The video can't be made", error);
    } finally {
      this.filming = null;
      this.refresh();
    }
  }

  private refuse(what: string, error: unknown): void {
    if (!(error instanceof DOMException)) throw error;
    this.say(`${what}: ${error.message}.`);
  }

  private save(what: string, suffix: string, content: Blob): void {
    const name = fileName(this.viewer.bundle.manifest.specimen.name, what, suffix);
    saveFile(name, content);
    this.say(`Saved: ${name}`);
  }

  private saveMeasurements(): void {
    const { state } = this.viewer;
    const list = allOf(state);
    if (list.length === 0) {
      this.say(REFUSED.measured);
      return;
    }
    this.save("measurements", "csv", new Blob([measurementsCsv(list)], { type: "text/csv" }));
  }

  private saveObjects(): void {
    const { objects } = this.viewer;
    if (objects.length === 0) {
      this.say("No label map is shown, so there are no objects to save.");
      return;
    }
    for (const { id, text } of this.viewer.objectsCsv()) {
      const name = objects.length === 1 ? "objects" : `objects-${id}`;
      if (text === null)
        this.say("The values of the objects are still loading: save them again in a moment.");
      else this.save(name, "csv", new Blob([text], { type: "text/csv" }));
    }
  }

  private get shown(): Box {
    return shownBox(this.viewer.bundle.manifest, this.viewer.state.isolated);
  }

  /** A panel in the room has another view. */
  private factsFor({ isHistogramOpen, picked }: PanelView): Facts {
    const { viewer, stereo } = this;
    const hasHistogram = isHistogramOpen && picked !== null && this.ranges.has(picked);
    const { specimen } = viewer.bundle.manifest;
    const {
      triangles,
      volumes,
      traced,
      isLoading,
      gazed: focusTile,
      discLimit_deg,
      frame_ms,
      isStereo,
      settings,
    } = viewer.snapshot();
    const drawn = [...volumes, traced];
    const levels = drawn.flatMap(({ level }) => (level === null ? [] : [level]));
    return {
      title: specimen.name,
      subtitle: this.options.subtitle,
      isPatient: specimen.sides !== undefined,
      shown: this.shown,
      ranges: this.ranges,
      histogram: hasHistogram ? viewer.histogram(picked) : null,
      focusTile,
      discLimit_deg,
      isStereo,
      stereo,
      split: viewer.stereo.kind === "headset" ? null : SPLIT,
      canScan: this.canScan,
      hasRoom: this.hasRoom && viewer.stereo.kind === null,
      faultOfCode,
      frame_ms: frame_ms > 0 ? frame_ms : null,
      settings,
      triangles,
      volumeLevel: levels.length > 0 ? Math.min(...levels) : null,
      samples: traced.level === null ? null : traced.samples,
      isLoading,
      values: viewer.snapshot().measuredValues,
      sliceValues: viewer.sliceValues,
      objects: viewer.objects,
      isFilming: this.filming !== null,
      undo: viewer.undoes,
      redo: viewer.redoes,
    };
  }

  dispose(): void {
    clearTimeout(this.timer);
    this.disposed.abort();
    this.panel.root.remove();
    this.help?.dispose();
    this.card?.dispose();
    this.tapped?.dispose();
    this.message?.dispose();
  }
}
