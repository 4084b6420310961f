/** What lies over the picture: the progress bar, notices, and the page of a fatal error. */
import type { Progress } from "../mesh/progress";
import { element } from "./dom";

/** A thin bar at the top with its count in words; hidden once complete. */
export class ProgressBar {
  private readonly fill = element("div", { className: "fill" });
  private readonly label = element("span");
  readonly root = element(
    "div",
    { className: "progress", role: "progressbar" },
    { progress: "" },
    element("div", { className: "track" }, {}, this.fill),
    this.label,
  );

  update({ done, total, isComplete }: Progress): void {
    this.root.hidden = isComplete;
    this.fill.style.width = `${(100 * done) / Math.max(1, total)}%`;
    this.label.textContent = `Loading the overview: ${done} of ${total} surfaces`;
    this.root.ariaValueNow = String(done);
    this.root.ariaValueMax = String(total);
  }
}

/** Faults that leave the rest usable. Each can be dismissed. */
export class Notices {
  readonly root = element("div", { className: "notices", role: "status" }, { notices: "" });

  constructor(private readonly onDismiss: (text: string) => void) {}

  update(notices: readonly string[]): void {
    // A broken host fails for every file: the newest few say what is wrong.
    const shown = notices.slice(-3);
    const hidden = notices.length - shown.length;
    this.root.replaceChildren(
      ...(hidden > 0 ? [element("p", { textContent: `and ${hidden} more like these` })] : []),
      ...shown.map((text) =>
        element(
          "p",
          {},
          {},
          element("span", { textContent: text }),
          element("button", {
            textContent: "×",
            ariaLabel: "Dismiss",
            onclick: () => this.onDismiss(text),
          }),
        ),
      ),
    );
  }
}

/** Nothing can be shown: say what is wrong and what can be done, in the page. */
export function showFatal(parent: HTMLElement, title: string, text: string): void {
  parent.replaceChildren(
    element(
      "main",
      { className: "fatal", role: "alert" },
      { fatal: "" },
      element("h1", { textContent: title }),
      element("p", { textContent: text }),
      element("button", { textContent: "Try again", onclick: () => location.reload() }),
    ),
  );
}
