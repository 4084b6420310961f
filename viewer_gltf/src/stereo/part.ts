/**
 * The part of the viewer that starts stereo: in a headset, in the user's own room, or on a phone's
 * split screen.
 */

import { BundleError } from "../bundle/errors";
import { isTouch } from "../dom/is_touch";
import { NOT_LOADED } from "../host/later";
import type { Part, PartDefinition, PartHost } from "../host/part";
import type { StereoFinder } from "../host/services";
import { startSplit } from "../host/start_split";
import type { Lenses, PanelView, PartSection } from "../panel/controls";
import type { CardMeasure } from "../panel/html/card_measure";
import type { XrSupport } from "../state/stereo";
import type { ViewerState } from "../state/viewer_state";
import { canScan, scanCode } from "../xr/cardboard/scan_qr";
import {
  BUILT_IN,
  faultOfCode,
  type Profile,
  ProfileError,
  parseProfile,
} from "../xr/cardboard/viewer_profile";
import type { ImmersiveMode } from "../xr/session";
import { findXrSupport, showsUsersRoom, wayToStereo } from "../xr/support";
import { STEREO_KEYS } from "./keys";
import {
  rememberEyes,
  rememberedEyes,
  rememberedLens,
  rememberedScreen,
  rememberLens,
  rememberScreen,
} from "./remembered";
import { stereoSections } from "./section";

/** Stereo on a phone counts as available: the start itself reports what the phone lacks. */
const SPLIT: XrSupport = { isAvailable: true, reason: "" };
/**
 * Milliseconds from the first frame until stereo is loaded, in browsers that do not report idle
 * time.
 */
const AFTER_PICTURE_MS = 2000;
const NO_ROOM =
  "This browser can't show the specimen in your room: it has no augmented reality (AR).";

async function findSupport(): StereoFinder["found"] {
  const stereo = await findXrSupport(navigator.xr, isSecureContext);
  return { stereo, hasRoom: await showsUsersRoom(navigator.xr, isSecureContext) };
}

class StereoPart implements Part, StereoFinder {
  readonly id = "stereo";
  readonly services = { stereoSupport: this };
  readonly found = findSupport();
  readonly pageCommands = {
    stereo: () => this.toggleHeadset(),
    room: () => this.toggleRoom(),
    split: () => this.splitScreen(),
    scan: () => void this.scan(),
    "measure-screen": () => void this.measureScreen(),
  };
  private card: CardMeasure | null = null;

  constructor(private readonly host: PartHost) {
    host.lensesChosen.subscribe((lenses) => this.changeLenses(lenses));
  }

  begin(): void {
    const { host } = this;
    host.panel.show(rememberedLens());
    host.display.setScreen(rememberedScreen());
    for (const action of rememberedEyes()) host.dispatch(action);
    void canScan().then((isAble) => host.panel.addFacts({ canScan: isAble }));
  }

  async afterOpening(): Promise<void> {
    this.host.panel.addFacts(await this.found);
  }

  /** Loads the code of stereo while the page is idle, if stereo is available. */
  async afterOverview(): Promise<void> {
    const { stereo, hasRoom } = await this.found;
    if (wayToStereo(stereo, isTouch()) === null && !hasRoom) return;
    // A start reports the failure.
    const prepare = () => void this.host.stereo.prepare().catch(() => undefined);
    if (typeof requestIdleCallback === "function") requestIdleCallback(prepare);
    else setTimeout(prepare, AFTER_PICTURE_MS);
  }

  sync(state: ViewerState, previous: ViewerState): void {
    rememberEyes(state, previous);
  }

  panel(view: PanelView): readonly PartSection[] {
    const { state, isInStereo, panel, stereo } = this.host;
    const { facts } = panel;
    const facing = {
      stereo: facts.stereo,
      split: stereo.kind === "headset" ? null : SPLIT,
      canScan: facts.canScan,
      hasRoom: facts.hasRoom && !isInStereo,
      faultOfCode,
    };
    return stereoSections(state, { ...facing, isStereo: isInStereo }, view);
  }

  private toggleHeadset(): void {
    const { stereo, panel, isInStereo } = this.host;
    const { isAvailable, reason } = panel.facts.stereo;
    if (isInStereo) stereo.end();
    else if (isAvailable) void this.enter("immersive-vr");
    else this.host.announce(reason);
  }

  private toggleRoom(): void {
    const { stereo, panel, isInStereo } = this.host;
    if (isInStereo) stereo.end();
    else if (panel.facts.hasRoom) void this.enter("immersive-ar");
    else this.host.announce(NO_ROOM);
  }

  /** Must be called from a click or a key. */
  private async enter(mode: ImmersiveMode): Promise<void> {
    if (navigator.xr === undefined) return;
    try {
      await this.host.stereo.startHeadset(navigator.xr, mode);
    } catch (error) {
      if (!(error instanceof DOMException || error instanceof BundleError)) throw error;
      const text = `Stereo could not start: ${error.message}`;
      this.host.dispatch({ type: "notify", text });
    }
  }

  private splitScreen(): void {
    const { host } = this;
    const { lenses, code } = host.panel.view;
    host.stereo.showInPanel({ lenses, code });
    this.withProfile((profile) => {
      startSplit(host, profile).catch((error) => host.report(error));
    });
  }

  private changeLenses(lenses: Lenses): void {
    this.host.panel.change({ panel: "lenses", lenses });
    this.withProfile((profile) => this.host.stereo.setLenses(profile));
  }

  private withProfile(use: (profile: Profile) => void): void {
    const { lenses, code } = this.host.panel.view;
    try {
      use(lenses === "own" ? parseProfile(code) : BUILT_IN[lenses]);
      rememberLens({ lenses, code });
    } catch (error) {
      if (!(error instanceof ProfileError)) throw error;
      this.host.announce(error.message);
    }
  }

  private async scan(): Promise<void> {
    const { host } = this;
    const scanner = await import("../panel/html/qr_scanner").catch(() => null);
    if (scanner === null) {
      host.announce(NOT_LOADED);
      return;
    }
    try {
      const text = await scanner.scanByCamera(document.body, scanCode);
      if (text !== null) host.panel.change({ panel: "code", text });
    } catch (error) {
      if (!(error instanceof ProfileError || error instanceof DOMException)) throw error;
      host.announce(error.message);
    }
  }

  private async measureScreen(): Promise<void> {
    const { host } = this;
    const { display } = host;
    const parts = await Promise.all([
      import("../panel/html/card_measure"),
      import("../xr/cardboard/lens"),
    ]).catch(() => null);
    if (parts === null) {
      host.announce(NOT_LOADED);
      return;
    }
    const [{ CardMeasure }, { cssPixelsPerInch }] = parts;
    this.card ??= new CardMeasure(host.view.parentElement ?? host.view, (perInch) => {
      rememberScreen(perInch);
      display.setScreen(perInch);
      host.announce(
        `The screen has ${perInch} pixels per inch. The split screen now shows the specimen at the right size.`,
      );
    });
    const { userAgent } = navigator;
    this.card.open(display.cssPixelsPerInch ?? cssPixelsPerInch(userAgent, devicePixelRatio));
  }

  dispose(): void {
    this.card?.dispose();
  }
}

export const stereo: PartDefinition = {
  id: "stereo",
  keys: STEREO_KEYS,
  create: (host) => new StereoPart(host),
};
