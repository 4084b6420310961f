/** What lies over the picture in the page: progress, notices, the first hint, and the ways into stereo and back. */
import { hasFullScreen } from "../dom/full_screen";
import { isTouch } from "../dom/is_touch";
import type { PartHost } from "../host/part";
import type { PagePanel } from "../host/services";
import { FirstHint, Notices, ProgressBar, Said, WayBack } from "../panel/html/overlays";
import { arAddress, WaysIn } from "../panel/html/ways_in";
import { wayToStereo } from "../xr/support";

/** Whether someone has taken the page in hand, which another view of the specimen may have taken over since. */
let wasTouched = false;

export class Overlays {
  readonly said = new Said();
  private readonly waysIn = new WaysIn();
  private readonly hint: FirstHint;

  constructor(
    private readonly host: PartHost,
    private readonly page: Pick<PagePanel, "perform">,
    private readonly signal: AbortSignal,
  ) {
    const { said, waysIn } = this;
    const progress = new ProgressBar();
    const notices = new Notices(
      (texts) => host.dispatch({ type: "dismiss", texts }),
      () => host.run("retry"),
    );
    const hint = new FirstHint(isTouch(), window.parent !== window);
    const wayBack = new WayBack(() => host.run("back"));
    this.hint = hint;
    host.view.append(
      ...[hint.root, progress.root, said.root, notices.root, waysIn.root, wayBack.root],
    );
    host.changed.subscribe((state) => {
      for (const each of [notices, hint, wayBack]) each.update(state);
    });
    host.drawn.subscribe(() => progress.update(host.display.snapshot().overview));
    notices.update(host.state);
  }

  /** The view of the address is open: the hint stays until someone takes the page in hand. */
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

  /** Offers the ways into stereo, the user's room and the full screen that this device has. */
  async offerWaysIn(): Promise<void> {
    const { host, page, waysIn } = this;
    const support = await host.service("stereoSupport")?.found;
    if (support !== undefined) {
      const way = wayToStereo(support.stereo, isTouch());
      waysIn.offerStereo(way, () => way && page.perform(way));
    }
    if (hasFullScreen()) waysIn.offerFullScreen(() => page.perform("full-screen"));
    if (support?.hasRoom) waysIn.offerRoom(() => page.perform("room"));
    const usdz = arAddress(host.bundle);
    if (usdz !== null) waysIn.offerLink(usdz);
  }
}
