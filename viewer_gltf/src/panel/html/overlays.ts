/** Elements over the picture: the progress bar, notices, and the page of a fatal error. */

import { element, setText } from "../../dom/element";
import { groupNotices } from "../../state/notice_groups";
import type { Progress } from "../../state/overview_progress";
import type { Mode } from "../../state/parameters/volumes";
import { showsVolumes, type ViewerState } from "../../state/viewer_state";

/** Time for which an announcement stays, ms; a screen reader reads it at once. */
const SAID_MS = 4000;
/** Time for which an announcement with a button stays, ms: a person has to find the button first. */
const OFFERED_MS = 8000;

/** A thin bar at the top with its count in words; hidden once complete. */
export class ProgressBar {
  private readonly fill = element("div", { className: "fill" });
  private readonly label = element("span");
  readonly root = element(
    "div",
    { className: "progress", role: "progressbar", ariaLabel: "Loading of the overview" },
    { progress: "" },
    element("div", { className: "track" }, {}, this.fill),
    this.label,
  );

  update({ done, total, isComplete }: Progress): void {
    this.root.hidden = isComplete;
    this.fill.style.width = `${(100 * done) / Math.max(1, total)}%`;
    setText(this.label, `Loading the overview: ${done} of ${total} surfaces`);
    this.root.ariaValueNow = String(done);
    this.root.ariaValueMax = String(total);
  }
}

/** Faults that leave the rest usable. Each can be dismissed. */
export class Notices {
  readonly root = element("div", { className: "notices", role: "status" }, { notices: "" });

  private drawn: readonly string[] = [];
  private readonly retry = element(
    "button",
    { textContent: "Try again", onclick: () => this.onRetry() },
    { action: "retry" },
  );

  constructor(
    private readonly onDismiss: (texts: readonly string[]) => void,
    private readonly onRetry: () => void,
  ) {}

  update({ notices, mendable }: Pick<ViewerState, "notices" | "mendable">): void {
    if (notices === this.drawn) return; // what is written anew is read out anew
    this.drawn = notices;
    // A broken host fails for every file: the newest few notices are enough.
    const groups = groupNotices(notices);
    const shown = groups.slice(-3);
    const hidden = groups.length - shown.length;
    this.root.replaceChildren(
      ...(hidden > 0 ? [element("p", { textContent: `and ${hidden} more like these` })] : []),
      ...shown.map(({ text, of }) =>
        element(
          "p",
          {},
          {},
          element("span", { textContent: text }),
          element("button", {
            textContent: "×",
            ariaLabel: `Dismiss: ${text}`,
            onclick: () => this.onDismiss(of),
          }),
        ),
      ),
      ...(mendable.length > 0 ? [this.retry] : []),
    );
  }
}

/** Text on the result of going near, or of waiting, by the mode that shows volumes. */
const THEN: Readonly<Partial<Record<Mode, string>>> = {
  disc: ", go near for volumes",
  tile: ", go near for volumes",
  traced: "; at rest the picture clears up",
};

/** How to begin, beside a picture that nobody has touched yet. */
export class FirstHint {
  /** What a small window has no room for. */
  private readonly outcome = element("span");
  readonly root: HTMLElement;

  /** @param isFramed whether the wheel alone scrolls the page that holds this one */
  constructor(isTouch: boolean, isFramed: boolean) {
    const zoom = isTouch ? "pinch" : isFramed ? "Ctrl and wheel" : "wheel";
    const words = `drag to turn, ${zoom} to zoom`;
    this.root = element("p", { className: "first-hint" }, { overlay: "hint" }, words, this.outcome);
  }

  update(state: Pick<ViewerState, "mode" | "channels" | "tiles">): void {
    const isNews = showsVolumes(state) && !state.tiles.some((tile) => tile.isUnfinished);
    setText(this.outcome, isNews ? (THEN[state.mode] ?? "") : "");
  }

  /** From the first touch on nobody needs it. */
  leave(): void {
    this.root.classList.add("gone");
  }
}

/** Says in a line what a key or a button has just done. The line goes by itself, unless someone is about to undo it. */
export class Said {
  private readonly words = element("p", { role: "status" }, { said: "" });
  private readonly button = element("button", { type: "button" }, { action: "offer" });
  readonly root = element("div", { className: "said" }, {}, this.words);
  private timer = 0;

  say(text: string): void {
    this.write(text, SAID_MS);
  }

  /** A button beside the words, if they still stand. */
  offer(text: string, label: string, act: () => void): void {
    if (this.words.textContent !== text) return;
    this.write(text, OFFERED_MS);
    setText(this.button, label);
    this.root.append(this.button);
    this.button.onclick = () => {
      this.write("", 0);
      act();
    };
  }

  /** Take the button away: its offer holds no longer. */
  withdraw(): void {
    this.button.remove();
  }

  private write(text: string, for_ms: number): void {
    setText(this.words, text);
    this.withdraw();
    clearTimeout(this.timer);
    if (text !== "") this.leaveLater(for_ms);
  }

  private leaveLater(after_ms: number): void {
    this.timer = window.setTimeout(() => {
      if (this.button.matches(":hover, :focus")) this.leaveLater(SAID_MS);
      else this.write("", 0);
    }, after_ms);
  }
}

/** The way back from a tile that is shown alone, for thumbs: see overlays.css. */
export class WayBack {
  readonly root: HTMLButtonElement;

  constructor(onBack: () => void) {
    this.root = element(
      "button",
      {
        ...{ type: "button", className: "way way-back", textContent: "Back to all tiles" },
        ...{ hidden: true, onclick: onBack },
      },
      { overlay: "back" },
    );
  }

  update({ isolated }: Pick<ViewerState, "isolated">): void {
    this.root.hidden = isolated === null;
  }
}

/** Nothing can be shown: report the fault and what can be done, in the page. */
export function showFatal(parent: HTMLElement, title: string, text: string): void {
  parent.replaceChildren(
    element(
      "main",
      { className: "fatal" },
      { fatal: "" },
      element(
        "div",
        { role: "alert" },
        {},
        element("h1", { textContent: title }),
        element("p", { textContent: text }),
      ),
      element("button", { textContent: "Try again", onclick: () => location.reload() }),
    ),
  );
}
