/** Keeps everything that was shown for a visit without a network, and announces how much that is. */

import type { Bundle } from "../bundle/load";
import { allAnswered, keyOf } from "../bundle/request_log";
import type { PartHost } from "../host/part";
import { arAddress } from "../panel/html/entry_buttons";
import { showsVolumes } from "../state/viewer_state";
import { type Coverage, coverageOf, coverageText } from "./coverage";
import { OfflineLayers } from "./layers";
import { Keeping } from "./register";
import { isKept } from "./request_plan";

/** Time between two checks for new files, ms. */
const LOOK_MS = 2000;

/** Returns addresses of files of the bundle that are kept although the page has not requested them. */
function alsoKept(bundle: Bundle): readonly string[] {
  const usdz = arAddress(bundle);
  return usdz !== null && isKept(bundle.manifest.usdz ?? null) ? [usdz] : [];
}

export class KeepOffline {
  private readonly layers: OfflineLayers;
  /** The number of answers and the layers shown at the last check; a check without a change is skipped. */
  private looked = "";
  /** Whether this visit, or one before, has announced how much is kept. */
  private hasAnnounced: boolean;
  private isReady: boolean;
  /** Requests that the worker had missed and was asked to keep. */
  private readonly missed = new Set<string>();

  private constructor(
    private readonly host: PartHost,
    private readonly keeping: Keeping,
  ) {
    this.layers = new OfflineLayers(host);
    this.hasAnnounced = keeping.wasServed;
    this.isReady = keeping.wasServed;
  }

  /**
   * Starts after the first frame. From then on the page's root element has `data-offline`. It is "partly" once everything
   * that was shown and can be kept is kept, and "ready" once every tile is kept. It is "refused" if the browser keeps
   * nothing, for example on a full disk.
   */
  static async start(host: PartHost): Promise<void> {
    const keeping = await Keeping.start();
    if (keeping === null) return;
    if (!(await keeping.adopt(null, alsoKept(host.bundle)))) {
      document.documentElement.dataset.offline = "refused";
      return;
    }
    const part = new KeepOffline(host, keeping);
    const look = () => part.look().catch(() => undefined); // the network failed; the next check may succeed
    await look();
    setInterval(look, LOOK_MS);
  }

  private async look(): Promise<void> {
    const { state, display } = this.host;
    const { channels, mode } = state;
    const shown = channels.filter((each) => each.shown).map(({ id, volume }) => [id, volume]);
    const looked = JSON.stringify([allAnswered().length, mode, shown]);
    if (looked === this.looked || display.isLoading || !navigator.onLine) return;
    const coverage = await this.coverage();
    if (coverage === "later") return;
    this.looked = looked;
    this.report(coverage);
  }

  /** Returns how much is kept; "later" while the worker fetches missed files; null if some shown files can't be kept. */
  private async coverage(): Promise<Coverage | "later" | null> {
    const { host, keeping } = this;
    const layers = await this.layers.now();
    const answered = allAnswered();
    const levels = layers.flat().flatMap((each) => each.levels.flat());
    const asked = [
      ...new Map([...answered, ...levels].map((each) => [keyOf(each), each])).values(),
    ];
    const areKept = await keeping.isKept(asked);
    const kept = new Set(asked.filter((_, i) => areKept[i]).map(keyOf));
    const missed = answered.filter((each) => !kept.has(keyOf(each)));
    const news = missed.filter((each) => !this.missed.has(keyOf(each)));
    if (news.length > 0) {
      for (const each of news) this.missed.add(keyOf(each));
      await keeping.adopt(news, []);
      return "later";
    }
    if (missed.length > 0) return null;
    const { manifest, bricks } = host.bundle;
    // Bricks are sent for each view, so that the host is needed for each view.
    if (bricks !== undefined && showsVolumes(host.state)) return { tiles: 0, isByView: true };
    const tiles = manifest.tiles.map(({ id }) => id);
    return coverageOf(tiles, layers, answered, kept);
  }

  private report(coverage: Coverage | null): void {
    const { length } = this.host.bundle.manifest.tiles;
    const isReady = coverage?.tiles === length;
    document.documentElement.dataset.offline = isReady ? "ready" : "partly";
    // Only the first state and "ready" are announced; an announcement for each further tile would disturb.
    if (coverage !== null && (!this.hasAnnounced || (isReady && !this.isReady))) {
      this.host.service("page")?.showAnnouncement(coverageText(coverage, length));
      this.hasAnnounced = true;
    }
    this.isReady = isReady;
  }
}
