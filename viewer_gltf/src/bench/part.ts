/** The benchmark as a part of the viewer. Its code loads only if the address asks for it (`?bench`). */
import { pageAddress } from "../bundle/address";
import type { Part, PartDefinition, PartHost } from "../host/part";
import type { BenchResult } from "../host/services";
import { startSplit } from "../host/start_split";
import { CARDBOARD_V2 } from "../xr/cardboard/viewer_profile";
import { flightAsked } from "./bench_parameter";
import type { Report } from "./report";

class BenchPart implements Part, BenchResult {
  readonly id = "bench";
  readonly services = { bench: this };
  report: Report | null = null;

  constructor(private readonly host: PartHost) {}

  async afterOpening(): Promise<void> {
    const flight_s = flightAsked(new URL(pageAddress()).search);
    if (flight_s === null) return;
    const { host } = this;
    const [{ benchCard }, { subjectOf }, support] = await Promise.all([
      import("./bench_card"),
      import("./bench_subject"),
      host.service("stereoSupport")?.found,
    ]);
    const card = benchCard(flight_s, {
      subject: subjectOf(host),
      stereo: support?.stereo.isAvailable ? ["headset", "split"] : ["split"],
      startStereo: async (kind) => {
        if (kind === "split") await startSplit(host, CARDBOARD_V2);
        else if (navigator.xr !== undefined) await host.stereo.startHeadset(navigator.xr);
      },
      onReport: (report) => {
        this.report = report;
      },
    });
    host.view.after(card);
  }

  dispose(): void {}
}

export const bench: PartDefinition = {
  id: "bench",
  create: (host) => new BenchPart(host),
};
