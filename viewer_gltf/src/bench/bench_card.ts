/**
 * The benchmark's card over the view (`?bench`). It asks for a tap, shows the progress, and then the table, the chart
 * and the report to save. With `?bench=2` each run takes two seconds.
 */
import "./bench.css";
import { element, setText } from "../dom/element";
import { drawChart } from "./chart";
import type { Report } from "./report";
import { runAll, type Step, type Subject } from "./runs";

type StereoKind = "split" | "headset";

export type BenchOptions = Readonly<{
  subject: Subject;
  /** The kinds of stereo that this device has. */
  stereo: readonly StereoKind[];
  /** Must be called from a tap. Rejects if the browser or the user refuses. */
  startStereo: (kind: StereoKind) => Promise<void>;
  onReport: (report: Report) => void;
}>;

export function benchCard(flight_s: number, options: BenchOptions): HTMLElement {
  const { subject, stereo, startStereo } = options;
  const status = element(
    "p",
    {
      textContent:
        "The specimen flies once around and towards you, in every mode and at every size of its volumes. " +
        "Keep this page visible until the table appears.",
    },
    {},
  );
  const buttons = [null, ...stereo].map((kind) =>
    element(
      "button",
      { type: "button", textContent: kind === null ? "Start" : `Start, with ${WORDS[kind]}` },
      { bench: kind ?? "mono" },
    ),
  );
  const card = element(
    "section",
    { className: "bench", ariaLabel: "Benchmark" },
    { bench: "card" },
    element("h2", { textContent: "How fast is this device?" }),
    status,
    ...buttons,
  );
  buttons.forEach((button, i) => {
    const kind = [null, ...stereo][i];
    button.onclick = () => {
      for (const each of buttons) each.remove();
      void start(kind);
    };
  });
  const start = async (kind: StereoKind | null) => {
    try {
      // Stereo is requested within the tap, since browsers allow it only then.
      const begun = kind === null ? null : await startStereo(kind).then(() => kind, refused);
      const report = await runAll(subject, begun, flight_s, (step) => setText(status, words(step)));
      await subject.endStereo();
      options.onReport(report);
      status.remove();
      card.append(...resultOf(report));
    } catch (error) {
      setText(status, `The benchmark ended early: ${String(error)}`);
      throw error;
    }
  };
  const refused = (error: unknown) => {
    card.append(element("p", { textContent: `Stereo could not start: ${String(error)}` }));
    return null;
  };
  return card;
}

const WORDS: Record<StereoKind, string> = { split: "the split screen", headset: "the headset" };

/** Returns the progress, such as "2 of 12: disc, split, volumes of 256 voxels". */
function words({ index, count, mode, eyes, edge }: Step): string {
  const size = edge === null ? "" : `, volumes of ${edge} voxels`;
  return `${index + 1} of ${count}: ${mode}, ${eyes}${size}`;
}

function resultOf(report: Report): readonly HTMLElement[] {
  const canvas = element("canvas", { ariaLabel: "Frames per second by volume size" });
  canvas.role = "img";
  drawChart(canvas, report);
  const head = ["mode", "eyes", "voxels", "frames/s", "median ms", "95 % ms", "draw calls"];
  const row = (tag: "th" | "td", cells: readonly (string | number)[]) =>
    element("tr", {}, {}, ...cells.map((cell) => element(tag, { textContent: String(cell) })));
  const rows = report.runs.map((run) =>
    row("td", [
      run.mode,
      run.eyes,
      run.edge === null ? "" : `${run.edge}³`,
      run.fps,
      run.median_ms,
      run.p95_ms,
      run.drawCalls,
    ]),
  );
  const json = new Blob([`${JSON.stringify(report, null, 2)}\n`], { type: "application/json" });
  const link = (textContent: string, download: string, href: string) =>
    element("a", { textContent, download, href });
  return [
    canvas,
    element("table", {}, {}, row("th", head), ...rows),
    link("Save the figures (JSON)", "stereocell-fps.json", URL.createObjectURL(json)),
    link("Save the picture", "stereocell-fps.png", canvas.toDataURL("image/png")),
  ];
}
