/**
 * Elements over the view in the page: progress, notices, the first hint, and the buttons for stereo
 * and back.
 */
import { hasFullScreen } from "../dom/full_screen";
import { isTouch } from "../dom/is_touch";
import type { PartHost } from "../host/part";
import type { PagePanel } from "../host/services";
import { arAddress, EntryButtons } from "../panel/html/entry_buttons";
import { Announcement, BackButton, FirstHint, Notices, ProgressBar } from "../panel/html/overlays";
import { wayToStereo } from "../xr/support";

/**
 * Whether the user has touched the page. It stays true if a newer bundle of the specimen replaces
 * the shown one.
 */
let wasTouched = false;

export class Overlays {
  readonly announcement = new Announcement();
  private readonly entryButtons = new EntryButtons();
  private readonly hint: FirstHint;

  constructor(
    private readonly host: PartHost,
    private readonly page: Pick<PagePanel, "perform">,
    private readonly signal: AbortSignal,
  ) {
    const { announcement, entryButtons } = this;
    const progress = new ProgressBar();
    const notices = new Notices(
      (texts) => host.dispatch({ type: "dismiss", texts }),
      () => host.run("retry"),
    );
    const hint = new FirstHint(isTouch(), window.parent !== window);
    const backButton = new BackButton(() => host.run("back"));
    this.hint = hint;
    host.view.append(
      ...[
        hint.root,
        progress.root,
        announcement.root,
        notices.root,
        entryButtons.root,
        backButton.root,
      ],
    );
    host.changed.subscribe((state) => {
      for (const each of [notices, hint, backButton]) each.update(state);
    });
    host.drawn.subscribe(() => progress.update(host.display.snapshot().overview));
    notices.update(host.state);
  }

  /** Shows the hint until the user touches the page; called when the view of the address is open. */
  begin(): void {
    this.hint.update(this.host.state);
    const touched = new AbortController();
    const signal = AbortSignal.any([touched.signal, this.signal]);
    if (wasTouched) this.hint.leave();
    const touch = () => {
      wasTouched = true;
      touched.abort();
      this.host.viewpoint.stopTurning();
      this.hint.leave();
    };
    const options = { capture: true, passive: true, signal };
    for (const kind of ["pointerdown", "wheel", "keydown"]) addEventListener(kind, touch, options);
  }

  /** Offers the kinds of stereo, augmented reality and the full screen that this device has. */
  async offerWaysIn(): Promise<void> {
    const { host, page, entryButtons } = this;
    const support = await host.service("stereoSupport")?.found;
    if (support !== undefined) {
      const way = wayToStereo(support.stereo, isTouch());
      entryButtons.offerStereo(way, () => way && page.perform(way));
    }
    if (hasFullScreen()) entryButtons.offerFullScreen(() => page.perform("full-screen"));
    if (support?.hasRoom) entryButtons.offerRoom(() => page.perform("room"));
    const usdz = arAddress(host.bundle);
    if (usdz !== null) entryButtons.offerLink(usdz);
  }
}
