/** Elements over the view: the progress bar, notices, and the page of a fatal error. */

import { element, setText } from "../../dom/element";
import { groupNotices } from "../../state/notice_groups";
import type { Progress } from "../../state/overview_progress";
import type { Mode } from "../../state/parameters/volumes";
import { showsVolumes, type ViewerState } from "../../state/viewer_state";

/** Milliseconds for which an announcement stays; a screen reader reads it at once. */
const SHOWN_MS = 4000;
/**
 * Milliseconds for which an announcement with a button stays, because a user has to find the button
 * first.
 */
const OFFERED_MS = 8000;

/** A thin bar at the top with a count; hidden once complete. */
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

/** Notices of faults that leave the rest usable. Each can be dismissed. */
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

  update({ notices, retryable }: Pick<ViewerState, "notices" | "retryable">): void {
    if (notices === this.drawn) return; // screen readers read an element again when it is replaced
    this.drawn = notices;
    // A broken server fails for every file, so the newest few notices are enough.
    const groups = groupNotices(notices);
    const shown = groups.slice(-3);
    const hidden = groups.length - shown.length;
    this.root.replaceChildren(
      ...(hidden > 0 ? [element("p", { textContent: `and ${hidden} more notices` })] : []),
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
      ...(retryable.length > 0 ? [this.retry] : []),
    );
  }
}

/** Second half of the hint, by mode: what the user sees after moving closer or waiting. */
const NEXT_STEP: Readonly<Partial<Record<Mode, string>>> = {
  disc: ", move closer for volumes",
  tile: ", move closer for volumes",
  traced: ", hold still for a clearer image",
};

/** How to begin: a line over a view that nobody has touched yet. */
export class FirstHint {
  /** The second half of the hint, which is hidden in a small window. */
  private readonly outcome = element("span");
  readonly root: HTMLElement;

  /** @param isFramed whether this page is in a frame, whose holder scrolls with the wheel */
  constructor(isTouch: boolean, isFramed: boolean) {
    const zoom = isTouch ? "pinch" : isFramed ? "Ctrl and wheel" : "wheel";
    const words = `drag to turn, ${zoom} to zoom`;
    this.root = element("p", { className: "first-hint" }, { overlay: "hint" }, words, this.outcome);
  }

  update(state: Pick<ViewerState, "mode" | "channels" | "tiles">): void {
    const isUseful = showsVolumes(state) && !state.tiles.some((tile) => tile.isUnfinished);
    setText(this.outcome, isUseful ? (NEXT_STEP[state.mode] ?? "") : "");
  }

  /** Hides the line after the first touch. */
  leave(): void {
    this.root.classList.add("gone");
  }
}

/**
 * Announces in a line what a key or a button has just done. The line disappears after some time,
 * unless the pointer or the focus is on its button.
 */
export class Announcement {
  private readonly words = element("p", { role: "status" }, { announcement: "" });
  private readonly button = element("button", { type: "button" }, { action: "offer" });
  readonly root = element("div", { className: "announcement" }, {}, this.words);
  private timer = 0;

  show(text: string): void {
    this.write(text, SHOWN_MS);
  }

  /** Adds a button to the announcement, if it is still shown. */
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

  /** Removes the button, because its offer no longer applies. */
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
      if (this.button.matches(":hover, :focus")) this.leaveLater(SHOWN_MS);
      else this.write("", 0);
    }, after_ms);
  }
}

/**
 * The button that leads from an isolated tile back to all tiles, within reach of a thumb (see
 * overlays.css).
 */
export class BackButton {
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

/** Shows a fatal error on the page, with a button to try again. */
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
